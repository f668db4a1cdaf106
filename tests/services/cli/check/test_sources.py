"""`rhot check` on the source of the objects: recordings of every kind, and libsurvive."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects, ObjectTable
from services.cli.check.sources import check_object_source


def told(folder: Path, source: str, serials: tuple[str, ...] = ("LHR-1",)) -> list[str]:
    config = RigConfig(
        objects=Objects(source=source),
        object=[ObjectTable(name=f"o{i}", serial=serial) for i, serial in enumerate(serials)],
        folder=str(folder),
    )
    problems = check_object_source(config, folder / "rig.toml")
    return [f"{problem.severity}: {problem.what}" for problem in problems]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "error: .*there is no file"),
        ("", "error: .*no poses in it"),
        ("some\ntext\n", "error: .*no poses in it; known rows"),
        ('{"v": 1}\n', "error: .*line 1: not a OpenVrPose"),
        ("1 2 3 1 0 0 0\n", None),
        ("0.1 INFO LOG x\n28.3 WM0 POSE 1 2 3 1 0 0 0\n", None),
        ("0.1 INFO LOG x\n28.3 WM0 W 1 2\n", "error: .*no POSE lines.*playback:poses.txt"),
    ],
)
def test_recordings(tmp_path: Path, content: str | None, said: str | None) -> None:
    if content is not None:
        (tmp_path / "poses.txt").write_text(content)
    found = told(tmp_path, "replay:poses.txt")
    if said is None:
        assert found == []
    else:
        (text,) = found
        assert re.match(said, text)


def test_a_recording_that_names_no_device_of_several(tmp_path: Path) -> None:
    (tmp_path / "poses.txt").write_text("1 2 3 1 0 0 0\n")
    (text,) = told(tmp_path, "replay:poses.txt", ("LHR-1", "LHR-2"))
    assert text.startswith("warning: ")
    assert "give one of them the serial 'recorded'" in text


def test_libsurvive_where_it_is_and_is_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    recording = tmp_path / "x.rec"
    recording.write_text("0.1 INFO LOG x\n28.3 WM0 W 1 2\n")
    for source in ("libsurvive", "playback:x.rec"):
        (text,) = told(tmp_path, source)
        assert text.startswith("warning: ")
        assert "there is no survive-cli on the PATH; install libsurvive" in text
    (tmp_path / "survive-cli").touch(0o755)
    assert told(tmp_path, "libsurvive") == []
    assert told(tmp_path, "playback:x.rec") == []
    recording.write_text("1 2 3 1 0 0 0\n")
    (text,) = told(tmp_path, "playback:x.rec")
    assert "this is no recording of libsurvive; use replay:FILE" in text
    (text,) = told(tmp_path, "libsurvive:x")
    assert "is no source; valid: steamvr, libsurvive" in text
