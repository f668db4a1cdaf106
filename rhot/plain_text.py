"""Text of strangers, made harmless for a terminal, a journal or a browser's panel. Pure.

Names and sentences come over the network: an escape sequence in one would move the cursor, forge a
line or hide what follows.
"""

from __future__ import annotations

import unicodedata


def printable(text: str) -> str:
    """One line without control characters: each of them, line ends too, becomes a space."""
    # Not printable are also marks that turn the direction of writing, and halves of surrogates.
    return "".join(c if c.isprintable() else " " for c in text)


def clipped(text: str, width: int) -> str:
    """The printable text in at most width columns of a terminal; what is cut off ends in `…`."""
    text = printable(text)
    if columns(text) <= width:
        return text
    kept, used = [], 0
    for character in text:
        used += columns(character)
        if used > width - 1:
            break
        kept.append(character)
    return "".join(kept) + "…" if width > 0 else ""


def columns(text: str) -> int:
    """Columns that a printable text takes: two for wide characters, none for combining ones."""
    return sum(
        0 if unicodedata.combining(c) else 1 + (unicodedata.east_asian_width(c) in "WF")
        for c in text
    )
