"""A terminal's second screen: what was there before is back when the command ends."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TextIO

# What a terminal does: other screen and no cursor; back again.
_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"
_HOME, _REST_OF_LINE, _REST_OF_SCREEN = "\x1b[H", "\x1b[K", "\x1b[J"
_COLORS = {"ERROR": "\x1b[1;31m", "WARNING": "\x1b[33m"}
_PLAIN = "\x1b[0m"


@contextlib.contextmanager
def alternate_screen(out: TextIO | None = None) -> Iterator[Callable[[Sequence[str]], None]]:
    """`with alternate_screen() as show: show(lines)`; lines must fit (columns, lines of size())."""
    stream = out or sys.stdout
    colors = {} if os.environ.get("NO_COLOR") else _COLORS

    def show(lines: Sequence[str]) -> None:
        drawn = [_colored(line, colors) + _REST_OF_LINE for line in lines]
        # No line end after the last: it would scroll a full screen.
        stream.write(_HOME + "\n".join(drawn) + _REST_OF_SCREEN)
        stream.flush()

    stream.write(_ENTER)
    try:
        yield show
    finally:
        stream.write(_LEAVE)
        stream.flush()


def size() -> tuple[int, int]:
    """Columns and lines of the terminal now; 80 x 24 where it does not tell."""
    found = shutil.get_terminal_size((80, 24))
    return found.columns, found.lines


def _colored(line: str, colors: dict[str, str]) -> str:
    word = line.split(" ", 1)[0]
    return f"{colors[word]}{word}{_PLAIN}{line[len(word) :]}" if word in colors else line
