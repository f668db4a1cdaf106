"""docs/guide/videos.md, one finger: its commands do what it says on a rendered experiment."""

from __future__ import annotations

import shlex

import pytest
from typer.testing import CliRunner

from docs.generate.pages import ROOT
from services.cli.application import application
from testing.page_commands import commands

PAGE = ROOT / "docs" / "guide" / "videos.md"
# The page's pixels are those of this experiment's first picture.
RENDER = "grasp render --out made --subject subject-3 --cycles 3 --period 2 --fps 15"

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")


def test_the_commands_print_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke
    made = run(application(), shlex.split(RENDER))
    assert made.exit_code == 0, made.output
    (tmp_path / "made" / "subject-3.mp4").rename(tmp_path / "anna.mp4")
    found = commands(PAGE.read_text(encoding="utf-8"))
    assert len(found) == 3
    for command in found:
        done = run(application(), shlex.split(command.line)[1:])
        assert done.exit_code == 0, f"{command.line}: {done.output} {done.exception}"
        assert not command.missing(done.output), f"{command.line}: {done.output}"
    report = (tmp_path / "study" / "report" / "report.html").read_text(encoding="utf-8")
    assert "<h1>Anna, right index finger</h1>" in report
    assert (tmp_path / "anna" / "index.csv").read_text().startswith("frame,")
    assert (tmp_path / "anna" / "overlay.webm").stat().st_size > 10_000
