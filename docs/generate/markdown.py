"""Pieces of Markdown that several generated pages use."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence

COLUMNS = 100
# Names of code in a docstring: with an underscore inside, or a placeholder in angle brackets.
_NAMES = re.compile(r"(?<![\w`./-])(?:[A-Za-z]\w*_\w+|[\w./-]*<\w+>[\w./-]*\w)(?!`)")

_CODE = re.compile(r"`[^`]+`")
# Stands for a space at which no line may end.
_SPACE = "\x00"


def wrapped(text: str, indent: str = "", first: str | None = None) -> str:
    """Text in lines of at most COLUMNS; `first` begins the first line, `indent` the others.

    What stands in backticks stays on one line where it fits there.
    """
    joined = _CODE.sub(lambda match: _kept(match[0]), " ".join(text.split()))
    # A line that began with such a sign would be an item of a list.
    joined = re.sub(r" ([-+*#]) ", rf"{_SPACE}\1 ", joined)
    filled = textwrap.fill(
        joined,
        COLUMNS,
        initial_indent=indent if first is None else first,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return filled.replace(_SPACE, " ")


def _kept(code: str) -> str:
    return code.replace(" ", _SPACE) if len(code) < COLUMNS // 2 else code


def in_markdown(text: str) -> str:
    """Plain text of the code as Markdown: its names in backticks, so that no sign is lost."""
    parts = text.split("`")
    # Every other part is in backticks already.
    parts[::2] = [_NAMES.sub(r"`\g<0>`", part) for part in parts[::2]]
    return "`".join(parts)


def paragraphs(text: str) -> str:
    """A docstring as Markdown: its paragraphs, each in lines of at most COLUMNS."""
    return "\n\n".join(wrapped(in_markdown(part)) for part in text.split("\n\n") if part.strip())


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; a `|` inside a cell is escaped."""
    lines = [head, ["---"] * len(head), *rows]
    cells = ([cell.replace("|", "\\|") for cell in line] for line in lines)
    return "\n".join(f"| {' | '.join(line)} |".replace("  |", " |") for line in cells)


def generated_from(source: str) -> str:
    """The note under the title of a generated page."""
    return f"*Generated from {source} by `make docs`; do not edit.*"
