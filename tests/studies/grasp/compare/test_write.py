"""A comparison of three references and one who is judged; of two references without a band."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.compare.comparison import compared
from studies.grasp.compare.write import write_comparison
from studies.grasp.track import FingerTrack

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")


def silent(_: int):
    return lambda: None


@pytest.fixture(scope="module")
def few(paths):
    """With three markers and a closing each: how markers are chosen is tried elsewhere."""
    made = []
    for one in paths:
        t = one.tracks[0]
        joints = t.joints.copy()
        joints[:, 0] = np.nan
        track = FingerTrack(t.times_s, joints, t.angles_rad, np.nan * t.direction_rad, t.sigma)
        made.append(one._replace(tracks=[track]))
    return made


def test_pages_figures_and_tables(few, tmp_path):
    found = compared(few[:4], few[4:], 0.2, silent)
    files = write_comparison(found, tmp_path, "Title", "About.", 2.0, {"s1": ["a <note>"]})
    page = files[0].read_text()
    assert page.count("<img") == 4
    assert "a &lt;note&gt;" in page
    assert "2 deg" in page
    assert "Outside the band of 4 references" in page
    told = json.loads((tmp_path / "compare.json").read_text())
    assert told["references"] == 4
    assert told["procrustes"][1][1] == pytest.approx(0.0, abs=1e-9)
    assert [one["subject"] for one in told["judged"]] == ["s5"]
    rows = (tmp_path / "tables" / "markers.csv").read_text().splitlines()
    assert len(rows) == 1 + 7


def test_two_references_have_distances_and_no_band(few, tmp_path):
    found = compared(few[:2], few[2:3], 0.2, silent)
    assert found.band is None
    files = write_comparison(found, tmp_path, "Title", "About.", 2.0, {})
    assert "a band needs 3 people at least" in files[0].read_text()
    assert found.warping[0, 1] > 0.01


def test_recordings_of_one_person_count_as_one(few):
    again = [*few[:2], few[0]._replace(name="again")]
    found = compared(again, [], 0.2, silent)
    assert found.references == 2
    assert len(found.people[0].recordings) == 2


def test_fingers_are_not_mixed(few):
    with pytest.raises(CaptureError, match="of index and ring: a path is compared"):
        compared([few[0], few[1]._replace(finger="ring")], [], 0.2, silent)
