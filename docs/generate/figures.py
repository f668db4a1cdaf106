"""Figures in pages: a region's template, and the benchmarks' JSON that fills it in.

A region of a page is

    <!-- figures
    | a row | {accuracy/moving_rms_mm/0:.1f} mm |
    -->
    | a row | 2.6 mm |

    Made by `python benchmarks/accuracy.py`.
    <!-- end -->

and everything between the comments is written by `make docs`. A placeholder is
{file/key/key*factor:format}: a file of docs/figures without .json, the keys down to a number, and,
where it is wanted, a factor for another unit and a format of Python's. Keys may hold a `/`
themselves. In a template

    {accuracy/moving_rms_mm/[0;1;2]:.1f}    makes its cell of a table three cells
    ? at the beginning of a line            leaves it out where a key is missing (a peer that was
                                            not installed); anywhere else that is an error
    \\ at the end of a line                 continues it in the next

The commands that make the figures are named below each table.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from docs.generate.markdown import COLUMNS, wrapped

FOLDER = Path(__file__).parents[1] / "figures"
REGION = re.compile(r"<!-- figures\n(?P<template>.*?)\n-->\n(?P<body>.*?)<!-- end -->", re.DOTALL)
PLACEHOLDER = re.compile(
    r"\{(?P<file>[a-z0-9_]+)/(?P<path>[^{}:*]+)"
    r"(?:\*(?P<factor>[0-9.e+-]+))?(?::(?P<format>[^{}]+))?\}"
)
ALTERNATIVES = re.compile(r"\[([^\[\]{}]*;[^\[\]{}]*)\]")


class MissingFigureError(LookupError):
    """A placeholder names what no file of figures has."""


class Made(NamedTuple):
    """One file of figures."""

    command: str
    date: str
    machine: str
    short: bool
    figures: dict[str, Any]


def load(name: str, folder: Path = FOLDER) -> Made:
    """A file of figures; raises MissingFigureError if there is none."""
    path = folder / f"{name}.json"
    if not path.is_file():
        raise MissingFigureError(
            f"docs/figures/{name}.json: no such file; `make figures ARGS={name}`"
        )
    data = json.loads(path.read_text(encoding="utf-8"))
    return Made(**{key: data[key] for key in Made._fields})


def regions(text: str) -> Iterator[re.Match[str]]:
    """The regions of a page."""
    return REGION.finditer(text)


def sources(template: str) -> list[str]:
    """Names of the files of figures that a template uses, in the order of their first use."""
    text = "\n".join(template_lines(template))
    return list(dict.fromkeys(match["file"] for match in PLACEHOLDER.finditer(text)))


def rendered(text: str, folder: Path = FOLDER) -> str:
    """A page with all its regions filled in anew."""

    def region(match: re.Match[str]) -> str:
        template = match["template"]
        return f"<!-- figures\n{template}\n-->\n{body(template, folder)}<!-- end -->"

    return REGION.sub(region, text)


def body(template: str, folder: Path = FOLDER) -> str:
    """What stands between the comments of a region."""
    lines = []
    for line in template_lines(template):
        try:
            lines.append(_filled(line.removeprefix("?").lstrip(), folder))
        except MissingFigureError:
            if not line.startswith("?"):
                raise
    return "\n".join([*lines, "", _made_by(template, folder), ""])


def template_lines(template: str) -> list[str]:
    """Lines of a template, continued ones joined and cells repeated."""
    joined = re.sub(r"\\\n\s*", "", template).splitlines()
    return ["|".join(map(_cells, line.split("|"))) for line in joined]


def _cells(cell: str) -> str:
    """A cell once for each of its alternatives: `{a/[0;1]}` -> `{a/0} | {a/1}`."""
    choices = [match[1].split(";") for match in ALTERNATIVES.finditer(cell)]
    if not choices:
        return cell
    made = []
    for chosen in zip(*choices, strict=True):
        one = cell
        for word in chosen:
            one = ALTERNATIVES.sub(lambda _, word=word: word, one, count=1)  # type: ignore[misc]
        made.append(one)
    return "|".join(made)


def _filled(line: str, folder: Path) -> str:
    return PLACEHOLDER.sub(lambda match: _value(match, folder), line)


def _value(match: re.Match[str], folder: Path) -> str:
    value = look_up(load(match["file"], folder).figures, match["path"], match[0])
    if value is None:
        return "-"
    if match["factor"]:
        value = float(match["factor"]) * value
    # A space before the sign, as before every other unit.
    return re.sub("%$", " %", format(value, match["format"] or ""))


def look_up(figures: Any, path: str, asked: str) -> Any:
    """The value at keys joined by `/`; asked is the placeholder, for the error."""
    if not path:
        return figures
    if isinstance(figures, list):
        index, _, rest = path.partition("/")
        if index.isdigit() and int(index) < len(figures):
            return look_up(figures[int(index)], rest, asked)
    if isinstance(figures, dict):
        # A key may hold a `/` itself: the longest that fits.
        for key in sorted(figures, key=len, reverse=True):
            if path == key or path.startswith(f"{key}/"):
                return look_up(figures[key], path[len(key) + 1 :], asked)
    raise MissingFigureError(f"{asked}: the file has no such key")


def _made_by(template: str, folder: Path) -> str:
    """The line below a table: the commands, when and where they ran."""
    made = [load(name, folder) for name in sources(template)]
    if not made:
        raise MissingFigureError(f"a region without a figure: {template.splitlines()[0]}")
    commands = " ".join(f"`{one.command}`," for one in made).rstrip(",")
    dates = sorted({one.date for one in made})
    when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
    machines = "; ".join(dict.fromkeys(one.machine for one in made))
    short = " **A short run: placeholders, not figures.**" if any(m.short for m in made) else ""
    return wrapped(f"Made by {commands}; {when}, {machines}.{short}")


def too_wide(text: str) -> list[str]:
    """Lines of a page that are wider than COLUMNS, without those of tables and templates."""
    plain = REGION.sub(lambda match: match["body"], text)
    return [line for line in plain.splitlines() if len(line) > COLUMNS and line[:1] != "|"]
