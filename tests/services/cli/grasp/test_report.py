"""`rhot grasp report`: what it prints, and where nothing was recovered."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from rhot.errors import CaptureError
from services.cli.application import application
from studies.grasp.recover.result import SUFFIX, save_recovery

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")


def test_a_report_of_one_person(tmp_path):
    from studies.grasp.recover.study import Settings
    from testing.synthetic_fingers import PEOPLE, Motion, recorded_person
    from tests.studies.grasp.conftest import recovered

    one = recorded_person(PEOPLE[3], Motion(cycles=1, fps=20.0))
    (found,) = recovered([one], Settings(methods=("dls",)))
    save_recovery(tmp_path / f"s4{SUFFIX}", found)
    done = CliRunner().invoke(application(), ["grasp", "report", str(tmp_path), "--title", "Mine"])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "report" / "report.html").read_text()
    assert "<h1>Mine</h1>" in page
    assert "report.html" in done.output


def test_an_empty_folder(tmp_path):
    done = CliRunner().invoke(application(), ["grasp", "report", str(tmp_path)])
    assert isinstance(done.exception, CaptureError)
    assert "`rhot grasp recover RECORDING... --out`" in str(done.exception)
    assert not (tmp_path / "report").exists()
