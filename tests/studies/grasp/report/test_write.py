"""A whole report of two people: every figure, table and page; and of tips without angles."""

from __future__ import annotations

import csv
import json
import re

import cv2
import msgspec
import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.recording import save_recording
from studies.grasp.recover.result import SUFFIX, save_recovery
from studies.grasp.recover.study import Settings
from studies.grasp.report.path_figures import paths_of
from studies.grasp.report.study import load_study
from studies.grasp.report.write import write_report
from tests.studies.grasp.conftest import recovered

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")


@pytest.fixture(scope="module")
def folder(people, recoveries, tmp_path_factory):
    made = tmp_path_factory.mktemp("study")
    for k in (0, 3):
        save_recording(made / f"s{k}.json", people[k])
        save_recovery(made / f"s{k}{SUFFIX}", recoveries[k])
    named = msgspec.structs.replace(recoveries[3], subject="<script>alert(1)</script>")
    save_recovery(made / f"s3{SUFFIX}", named)
    (made / "left_out.txt").write_text("other.json: is no recording\n")
    return made


@pytest.fixture(scope="module")
def written(folder):
    steps = []

    def begun(figures):
        steps.append(figures)
        return lambda: steps.append(1)

    files = write_report(folder, folder / "report", "Study", "About.", begun)
    assert sum(steps[1:]) == steps[0]
    return files


def test_the_html_stands_by_itself(written):
    page = written[0].read_text()
    assert "<script" not in page
    assert "&lt;script&gt;alert(1)" in page
    sources = re.findall(r'(?:src|href)="([^"]{1,40})', page)
    assert sources
    assert all(one.startswith(("data:image/png;base64,", "#")) for one in sources)
    for title in ("Range of motion", "Joint angles", "Errors", "Paths of the tip", "DIP and PIP"):
        assert f">{title}</h2>" in page
    assert "other.json: is no recording" in page
    assert page.count("<img") == 6


def test_figures_have_ink_and_markdown_names_them(written, folder):
    text = (folder / "report" / "report.md").read_text()
    pictures = [path for path in written if path.suffix == ".png"]
    assert len(pictures) == 6
    for path in pictures:
        image = cv2.imread(str(path))
        assert min(image.shape[:2]) > 250
        assert np.count_nonzero(np.ptp(image.astype(int), axis=2) > 60) > 300, path.name
        assert f"(figures/{path.name})" in text


def test_tables_and_numbers_agree(written, folder):
    report = folder / "report"
    rows = list(csv.DictReader((report / "tables" / "errors.csv").read_text().splitlines()))
    told = json.loads((report / "report.json").read_text())
    for row in (one for one in rows if one["person"] == "everybody" and one["joint"] == "all"):
        numbers = next(
            one
            for one in told["errors"]
            if (one["method"], one["lengths"]) == (row["method"], row["lengths"])
        )
        assert float(row["rms_deg"]) == pytest.approx(numbers["joints"][-1]["rms"], abs=6e-4)
    assert {row["joint"] for row in rows} == {"mcp", "pip", "dip", "all"}
    frames = (report / "tables" / "angles.csv").read_text().count("\n") - 1
    # Two people, three closings, measured and seven methods with two kinds of lengths.
    assert frames == 2 * 3 * 37 * 15


def test_paths_begin_together(folder):
    for person in load_study(folder):
        paths = paths_of(person)
        assert paths.measured[0] == pytest.approx(paths.fixed[0])
        assert paths.own[0] == pytest.approx(paths.fixed[0])
        # Rigid bones: the three differ by noise only.
        assert np.abs(paths.own - paths.measured).max() < 0.5


def test_tips_without_angles_make_a_report_that_says_so(people, tmp_path):
    tips = msgspec.structs.replace(
        people[0],
        frames=[
            msgspec.structs.replace(
                frame, points={"tip": frame.points["tip"]}, angles_rad={}, tip_direction_rad=None
            )
            for frame in people[0].frames
        ],
    )
    (found,) = recovered([tips], Settings())
    save_recovery(tmp_path / f"tips{SUFFIX}", found)
    page, *_ = write_report(tmp_path, tmp_path / "report", "t", "a", lambda _: lambda: None)
    text = page.read_text()
    assert "No angles were measured" in text
    assert "the tip&#x27;s direction was not measured" in text
    assert "dls-position" in text


def test_a_folder_without_recoveries(tmp_path):
    with pytest.raises(CaptureError, match=r"holds no recovered\.json"):
        load_study(tmp_path)
    with pytest.raises(CaptureError, match="no such folder"):
        load_study(tmp_path / "none")
