"""Plain text tables that line up in a terminal, a log or a mail."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Columns as wide as their widest cell: the first to the left, the others to the right."""
    cells = [list(header), *(list(row) for row in rows)]
    widths = _widths(cells)
    lines = []
    for row in cells:
        numbers = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        lines.append("  ".join([row[0].ljust(widths[0]), *numbers]).rstrip())
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)


def plain(rows: Sequence[Sequence[str]]) -> str:
    """Rows without a header, all columns to the left."""
    widths = _widths(rows)
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def number(value: float | None, digits: int = 2) -> str:
    """A number, or `-` where there is none."""
    # Adding 0.0 turns the -0.0 of a rounded small number into 0.0.
    return "-" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"


def _widths(rows: Sequence[Sequence[str]]) -> list[int]:
    return [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
