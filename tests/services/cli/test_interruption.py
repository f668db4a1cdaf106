"""Ctrl-C and SIGTERM: one line, the shell's code, and what was there before."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

from services.cli.interruption import interruptible
from services.cli.offline.results import check_result


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_work_with_one_line(capsys, number, code):
    before = signal.getsignal(signal.SIGTERM)
    # A shell's background jobs ignore it.
    ignored = signal.signal(signal.SIGINT, signal.default_int_handler)
    tidied = []
    with pytest.raises(SystemExit) as ended, interruptible("rhot track", "out"):
        try:
            signal.raise_signal(number)
        finally:
            tidied.append(True)
    assert ended.value.code == code
    assert tidied
    assert capsys.readouterr().err == (
        "rhot track: interrupted; nothing unfinished is left in out; run it again\n"
    )
    signal.signal(signal.SIGINT, ignored)
    assert signal.getsignal(signal.SIGTERM) == before


def test_rhot_track_leaves_nothing_and_runs_again(short_capture, tmp_path):
    """A real process, interrupted while it writes; another one then makes the result."""
    out = tmp_path / "out"
    command = [sys.executable, "-m", "services.cli", "track", str(short_capture), "--out", str(out)]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    # Objects are written first of all.
    objects = out / "objects.jsonl.partial"
    while running.poll() is None and not (objects.exists() and objects.stat().st_size):
        time.sleep(0.01)
    running.terminate()
    told = running.communicate()[1]
    assert running.returncode == 143, told
    assert "rhot track: interrupted; " in told
    assert not out.exists()
    subprocess.run(command, check=True, capture_output=True)
    check_result(out, "poses")
