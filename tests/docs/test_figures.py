"""Figures in pages come from the benchmarks' JSON, and from nowhere else."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from docs.generate import figures
from docs.generate.figures import MissingFigureError, body, look_up, template_lines
from docs.generate.pages import ROOT, pages
from docs.generate.run_figures import RUNS, tidy

TEMPLATES = [
    (path.relative_to(ROOT), match["template"])
    for path in pages()
    for match in figures.regions(path.read_text(encoding="utf-8"))
]
FILES = sorted(figures.FOLDER.glob("*.json"))


def test_every_file_of_figures_has_its_benchmark_and_every_benchmark_its_file():
    assert {path.stem for path in FILES} == set(RUNS)


@pytest.mark.parametrize("name", RUNS)
def test_a_benchmark_that_is_named_exists(name):
    program = RUNS[name].program.removeprefix("python ")
    assert program.startswith("rhot ") or (ROOT / program).is_file()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_of_figures_was_made_by_its_command_and_names_no_machine(path):
    made, run = json.loads(path.read_bytes()), RUNS[path.stem]
    assert made["command"] == run.command(made["short"])
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", made["date"])
    assert not re.search(r"(?<![\w.])/(?:home|tmp|root|work|usr|opt)\b", path.read_text())


def test_figures_are_of_full_runs():
    short = [path.stem for path in FILES if json.loads(path.read_bytes())["short"]]
    assert not short, f"make figures ARGS='{' '.join(short)}'"


@pytest.mark.parametrize("name", RUNS)
def test_every_file_of_figures_is_used(name):
    assert any(name in figures.sources(template) for _, template in TEMPLATES)


def test_numbers_in_the_readme_come_from_figures():
    """Only the first column, which says what is measured, has numbers of its own."""
    (template,) = [text for path, text in TEMPLATES if path == Path("README.md")]
    for line in template_lines(template)[2:]:
        cells = line.removeprefix("?").strip().strip("|").split("|")[1:]
        written = figures.PLACEHOLDER.sub("", "|".join(cells))
        assert not re.search(r"\d", written), f"a number that is no figure: {line}"


def test_tables_of_numbers_in_notes_are_figures_or_name_their_source():
    for path in sorted((ROOT / "docs" / "notes").glob("*.md")):
        text = path.read_text(encoding="utf-8")
        for part in re.split(r"\n(?=#)", figures.REGION.sub("", text)):
            rows = [line for line in part.splitlines() if line[:1] == "|" and "---" not in line]
            if any(re.search(r"\d (?:mm|px|ms|us|%|deg|MB)", row) for row in rows):
                assert "pytest -rP" in part or "Source:" in part, f"{path}: {part[:80]}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Figures of a benchmark that does not exist."""
    made = {"command": "python benchmarks/x.py", "date": "2026-01-02", "machine": "2 cores"}
    values = {"a": {"0.5 m/s": [1.234, 2.0]}, "none": None, "share": 0.25, "ms": 0.0012}
    text = json.dumps({**made, "short": False, "figures": values})
    (tmp_path / "x.json").write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ("template", "expected"),
    [
        ("| {x/a/0.5 m/s/0:.1f} mm |", "| 1.2 mm |"),
        ("| {x/a/0.5 m/s/[0;1]:.1f} mm |", "| 1.2 mm | 2.0 mm |"),
        ("| {x/ms*1e3:.1f} us |", "| 1.2 us |"),
        ("| {x/share:.0%} | {x/none:.1f} |", "| 25 % | - |"),
        ("| {x/share} |\\\n  two |", "| 0.25 |two |"),
        ("| {x/share} |\n? | {x/absent:.1f} |", "| 0.25 |"),
    ],
)
def test_templates_are_filled_in(folder, template, expected):
    assert body(template, folder).partition("\n\n")[0] == expected


def test_the_command_stands_below_a_table(folder):
    made_by = "Made by `python benchmarks/x.py`; 2026-01-02, 2 cores.\n"
    assert body("| {x/share} |", folder) == f"| 0.25 |\n\n{made_by}"


def test_a_region_without_figures_is_an_error(folder):
    with pytest.raises(MissingFigureError, match="without a figure"):
        body("| 3 mm |", folder)


@pytest.mark.parametrize("path", ["absent", "a/absent", "a/0.5 m/s/2", "share/0"])
def test_a_key_that_is_missing_is_an_error(folder, path):
    with pytest.raises(MissingFigureError, match="no such key"):
        look_up(figures.load("x", folder).figures, path, "{x}")
    with pytest.raises(MissingFigureError, match="no such file"):
        figures.load("y", folder)


def test_figures_are_tidied():
    given = {"a": [1.23456789, "no /some/where/ball.mp4 here"], "b": 3}
    assert tidy(given) == {"a": [1.23457, "no ball.mp4 here"], "b": 3}
