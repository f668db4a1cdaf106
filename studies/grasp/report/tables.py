"""A table as rows of text: the same for Markdown, HTML and CSV. Pure."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from html import escape
from typing import NamedTuple


class Table(NamedTuple):
    """Rows of cells; a cell that is not known is empty."""

    name: str  # of its file
    title: str
    header: list[str]
    rows: list[list[str]]
    note: str = ""

    def markdown(self) -> str:
        """As Markdown; first column to the left, numbers to the right."""
        lines = [
            "| " + " | ".join(map(_cell, self.header)) + " |",
            "|" + "|".join(["---", *["---:"] * (len(self.header) - 1)]) + "|",
            *("| " + " | ".join(map(_cell, row)) + " |" for row in self.rows),
        ]
        return "\n".join(
            [f"**{_cell(self.title)}**", "", *lines, *(["", self.note] * bool(self.note))]
        )

    def html(self) -> str:
        """As an HTML table."""
        head = "".join(f"<th>{escape(one)}</th>" for one in self.header)
        rows = "\n".join(
            "<tr>" + "".join(f"<td>{escape(cell) or '&ndash;'}</td>" for cell in row) + "</tr>"
            for row in self.rows
        )
        note = f"<p class=note>{escape(self.note)}</p>" if self.note else ""
        return (
            f"<div class=table><table><caption>{escape(self.title)}</caption>"
            f"<thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table></div>{note}"
        )

    def csv(self) -> str:
        """As CSV with a header."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.header)
        writer.writerows(self.rows)
        return text.getvalue()


def number(value: float | None, places: int = 1) -> str:
    """A number with so many places; nothing where it is not known."""
    if value is None or value != value:
        return ""
    return f"{value:.{places}f}"


def mean_sd(pair: tuple[float, float], places: int = 0) -> str:
    """Such as `92 ± 3`; the mean alone where one value has no spread."""
    mean, sd = pair
    spread = number(sd, places)
    return f"{number(mean, places)} ± {spread}" if spread else number(mean, places)


def joined(values: Sequence[float], places: int = 1) -> str:
    """Numbers with slashes between."""
    return " / ".join(number(one, places) for one in values)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
