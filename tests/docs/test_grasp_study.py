"""docs/guide/grasp-study.md: its commands do what it says, on recordings as measured."""

from __future__ import annotations

import re
import shlex

import msgspec
import pytest
from typer.testing import CliRunner

from docs.generate.pages import ROOT
from services.cli.application import application
from studies.grasp.recording import save_recording
from testing.page_commands import commands
from testing.synthetic_fingers import PEOPLE, Motion, recorded_person

PAGE = ROOT / "docs" / "guide" / "grasp-study.md"
NAMES = ("anna", "ben", "cleo", "dora")

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")


def test_the_commands_print_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, person in zip(NAMES, PEOPLE, strict=False):
        (tmp_path / name).mkdir()
        made = recorded_person(person, Motion(cycles=1, fps=20.0, noise_mm=0.1))
        made = msgspec.structs.replace(made, subject=name, method="dots")
        save_recording(tmp_path / name / "index.json", made)
    found = commands(PAGE.read_text(encoding="utf-8"))
    assert len(found) == 3
    for command in found:
        done = CliRunner().invoke(application(), shlex.split(command.line)[1:])
        assert done.exit_code == 0, f"{command.line}: {done.output} {done.exception}"
        assert not command.missing(done.output), f"{command.line}: {done.output}"
    assert "<h1>Index fingers, November</h1>" in (tmp_path / "study/report/report.html").read_text()
    assert (tmp_path / "compared" / "compare.html").is_file()


def test_the_figure_is_small():
    pictures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", PAGE.read_text(encoding="utf-8"))
    assert pictures
    for name in pictures:
        assert (PAGE.parent / name).stat().st_size < 120_000
