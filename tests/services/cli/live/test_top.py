"""`rhot top` on a real terminal: it fits 80 x 24, and gives the screen back at its end."""

from __future__ import annotations

import fcntl
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
import threading

import pytest

COMMAND = [sys.executable, "-m", "services.cli", "top"]
ENTER, LEAVE = b"\x1b[?1049h\x1b[?25l", b"\x1b[?25h\x1b[?1049l"
DEADLINE_S = 60.0


class Terminal:
    """A terminal of 80 x 24, and what was written on it."""

    def __init__(self) -> None:
        self._ours, self.theirs = pty.openpty()
        fcntl.ioctl(self.theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        self.written = b""
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        while True:
            try:
                some = os.read(self._ours, 65536)
            except OSError:  # the other end is closed
                return
            with self._changed:
                self.written += some
                self._changed.notify_all()

    def wait_for(self, words: bytes) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: words in self.written, DEADLINE_S), self.written

    def close(self) -> bytes:
        os.close(self.theirs)
        self._reader.join(DEADLINE_S)
        os.close(self._ours)
        return self.written


@pytest.fixture
def terminal() -> Terminal:
    return Terminal()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_screen_is_given_back(router: str, terminal: Terminal, number: signal.Signals) -> None:
    with subprocess.Popen(
        [*COMMAND, "--connect", router],
        stdout=terminal.theirs,
        stderr=subprocess.PIPE,
        env={**os.environ, "NO_COLOR": "1"},
    ) as process:
        terminal.wait_for(b"rig sim")
        process.send_signal(number)
        assert process.stderr is not None
        said = process.stderr.read()
        assert process.wait(DEADLINE_S) == 0
    written = terminal.close()
    assert said == b""
    assert written.startswith(ENTER)
    assert written.endswith(LEAVE)
    first = written.removesuffix(LEAVE).split(b"\x1b[H")[1].decode()
    lines = first.removesuffix("\x1b[J").replace("\x1b[K", "").split("\r\n")
    assert len(lines) <= 24
    assert all(len(line) <= 80 for line in lines)
    assert any(line.startswith("ERROR   fusion is not running") for line in lines)


def test_once_prints_a_table_and_fails_where_something_is_missing(router: str) -> None:
    ended = subprocess.run(
        [*COMMAND, "--once", "--connect", router], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert "\x1b" not in ended.stdout
    assert "solver             absent" in ended.stdout


def test_a_reader_that_has_had_enough_ends_it_without_a_word(router: str) -> None:
    with subprocess.Popen(
        [*COMMAND, "--connect", router], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline().startswith(b"rig sim")
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(DEADLINE_S) == 1
