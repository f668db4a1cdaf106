"""The report as Markdown, and as one HTML file that needs nothing else; with what is beside."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

import msgspec

from studies.grasp.report.tables import Table

# Folders beside the pages.
FIGURES, TABLES = "figures", "tables"


class Picture(NamedTuple):
    """A drawn figure."""

    name: str
    title: str
    caption: str
    png: bytes


class Section(NamedTuple):
    """A heading with what stands below it."""

    title: str
    text: str
    parts: Sequence[Table | Picture]


class Report(NamedTuple):
    """Everything that pages show."""

    title: str
    about: str
    sections: Sequence[Section]
    notes: Mapping[str, Sequence[str]]  # by recording


_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#1a1a1a;max-width:1080px;margin:2em auto;
padding:0 1em}
h1{font-size:1.7em}h2{margin-top:2em;border-bottom:1px solid #bbb}
figure{margin:1.2em 0;page-break-inside:avoid}img{max-width:100%;height:auto}
figcaption,.note{color:#444;font-size:.9em;max-width:60em}
.table{overflow-x:auto;margin:1.2em 0 .3em}table{border-collapse:collapse;font-size:.88em}
caption{text-align:left;font-weight:600;padding:.3em 0}
th,td{padding:.25em .7em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}
th{border-bottom:2px solid #888}th:first-child,td:first-child{text-align:left}
td:nth-child(2){text-align:left}th:nth-child(2){text-align:left}
nav a{margin-right:1.2em}
@media print{nav{display:none}body{margin:0}}
"""


def markdown(report: Report, folder: str) -> str:
    """With figures as files in `folder`."""
    parts = [f"# {report.title}", "", report.about, ""]
    for section in report.sections:
        parts += [f"## {section.title}", ""]
        if section.text:
            parts += [section.text, ""]
        for part in section.parts:
            if isinstance(part, Table):
                parts += [part.markdown(), ""]
            else:
                parts += [f"![{part.title}]({folder}/{part.name}.png)", "", part.caption, ""]
    if report.notes:
        parts += ["## Notes of the recordings", ""]
        parts += [f"- {name}: {note}" for name, own in report.notes.items() for note in own]
    return "\n".join(parts).rstrip() + "\n"


def html(report: Report) -> str:
    """One file: figures are inside, no script, nothing from elsewhere."""
    links = "".join(
        f'<a href="#s{k}">{escape(section.title)}</a>' for k, section in enumerate(report.sections)
    )
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width,initial-scale=1">',
        f"<title>{escape(report.title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{escape(report.title)}</h1><p>{escape(report.about)}</p><nav>{links}</nav>",
    ]
    for k, section in enumerate(report.sections):
        parts.append(f'<h2 id="s{k}">{escape(section.title)}</h2>')
        if section.text:
            parts.append(f"<p>{escape(section.text)}</p>")
        parts += [one.html() if isinstance(one, Table) else _image(one) for one in section.parts]
    if report.notes:
        parts.append("<h2>Notes of the recordings</h2><ul>")
        parts += [
            f"<li><b>{escape(name)}</b>: {escape(note)}</li>"
            for name, own in report.notes.items()
            for note in own
        ]
        parts.append("</ul>")
    parts.append("</body></html>\n")
    return "\n".join(parts)


def written_report(
    report: Report, out: Path, name: str, numbers: bytes, more: Sequence[Table]
) -> list[Path]:
    """Write pages `name`, figures, tables (and `more` tables, as files only); HTML first."""
    (out / FIGURES).mkdir(parents=True, exist_ok=True)
    (out / TABLES).mkdir(parents=True, exist_ok=True)
    parts = [one for section in report.sections for one in section.parts]
    files = [out / f"{name}.html", out / f"{name}.md", out / f"{name}.json"]
    files[0].write_text(html(report), encoding="utf-8")
    files[1].write_text(markdown(report, FIGURES), encoding="utf-8")
    files[2].write_bytes(msgspec.json.format(numbers, indent=1) + b"\n")
    for one in [*parts, *more]:
        if isinstance(one, Table):
            files.append(out / TABLES / f"{one.name}.csv")
            files[-1].write_text(one.csv(), encoding="utf-8")
        else:
            files.append(out / FIGURES / f"{one.name}.png")
            files[-1].write_bytes(one.png)
    return list(dict.fromkeys(files))


def _image(picture: Picture) -> str:
    data = base64.b64encode(picture.png).decode()
    return (
        f'<figure><img alt="{escape(picture.title)}" src="data:image/png;base64,{data}">'
        f"<figcaption><b>{escape(picture.title)}.</b> {escape(picture.caption)}</figcaption>"
        "</figure>"
    )
