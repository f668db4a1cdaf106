"""Pictures of a step are gone with it, and those of a killed process with the next one."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from services.calibrator.endpoints.picture_folder import picture_folder

# Keeps a picture until it is killed.
STEP = """
import sys
from services.calibrator.endpoints.picture_folder import picture_folder
with picture_folder() as folder:
    (folder / "left_01.png").write_bytes(b"x")
    print(folder, flush=True)
    sys.stdin.read()
"""


def test_a_killed_process_leaves_nothing_for_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with subprocess.Popen(
        [sys.executable, "-c", STEP],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as step:
        assert step.stdout is not None
        theirs = Path(step.stdout.readline().strip())
        with picture_folder() as ours:
            assert ours != theirs
            assert (theirs / "left_01.png").exists(), "it is in use"
        assert not ours.exists()
        step.kill()
        step.wait()
    assert theirs.exists()
    with picture_folder() as ours:
        assert not theirs.exists()
        assert [one.parent for one in tmp_path.glob("*/lock")] == [ours]
    assert list(tmp_path.iterdir()) == []
