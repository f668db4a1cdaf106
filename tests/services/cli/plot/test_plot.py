"""`rhot plot` draws what a result holds, and says what is missing.

Without matplotlib: tests/services/test_entry_points.py.
"""

from __future__ import annotations

import shutil

import cv2
import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from rhot.errors import CaptureError
from rhot.files.calibration import load_hand
from rhot.files.capture import read_lines
from rhot.messages import HandPoints, HandPose
from services.cli.application import application
from services.cli.plot.result import _figures, plot_result
from services.cli.plot.rig_of_result import rig_of_result

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")


def test_every_kind_of_picture_is_drawn(capture, result, tmp_path):
    names = [path.name for path in plot_result(result, tmp_path, capture)]
    assert names == [
        "markers_left.png",
        "markers_right.png",
        "points_right.png",
        "angles_right.png",
        "residuals_right.png",
        "objects.png",
    ]
    for name in names:
        image = cv2.imread(str(tmp_path / name))
        assert min(image.shape[:2]) > 500
        # Some ink beside axes and text: coloured pixels.
        assert np.count_nonzero(np.ptp(image.astype(int), axis=2) > 60) > 300, name


def test_the_truth_changes_the_angles_picture(capture, result, tmp_path):
    plot_result(result, tmp_path / "without", None)
    plot_result(result, tmp_path / "with", capture)
    pictures = [
        (tmp_path / folder / "angles_right.png").read_bytes() for folder in ("without", "with")
    ]
    assert pictures[0] != pictures[1]


def test_angles_have_bands_of_sigma_and_the_limits_of_the_hand(capture, result):
    rig = rig_of_result(result)
    assert rig is not None
    figures = dict(_figures(result, [], rig))
    thumb, _, middle, *_ = figures["angles_right"].axes
    dotted = [line.get_ydata()[0] for line in thumb.lines if line.get_linestyle() == ":"]
    limits = load_hand(rig.calibration_dir, "right").limits_rad
    assert dotted == pytest.approx(np.rad2deg(limits[0]).ravel())
    # The middle finger's abduction cannot move.
    assert (len(thumb.collections), len(middle.collections)) == (4, 3)
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    width = np.rad2deg(2.0 * poses[0].fingers[0].sigma_rad)
    first = thumb.collections[0].get_paths()[0].vertices
    at_start = first[first[:, 0] == first[:, 0].min()][:, 1]
    assert np.ptp(at_start) == pytest.approx(width)
    points = list(read_lines(result / "points.jsonl", HandPoints))
    x = figures["points_right"].subfigs[0].axes[0]
    assert len(x.collections) == len({point.name for line in points for point in line.points})


def test_limits_are_the_tables_where_the_rig_is_gone(result, tmp_path):
    moved = tmp_path / "result"
    shutil.copytree(result, moved)
    summary = msgspec.json.decode((moved / "summary.json").read_bytes())
    (moved / "summary.json").write_bytes(msgspec.json.encode({**summary, "origin": None}))
    assert rig_of_result(moved) is None
    title = dict(_figures(moved, [], None))["angles_right"].get_suptitle()
    assert "limits of the tables" in title


def test_pictures_go_beside_the_result_and_it_can_still_be_tracked_into(result, tmp_path):
    shutil.copytree(result, tmp_path / "result")
    ran = CliRunner().invoke(application(), ["plot", str(tmp_path / "result")])
    assert ran.exit_code == 0
    assert "angles_right.png" in ran.stdout
    from services.cli.offline.results import ResultWriter

    ResultWriter(tmp_path / "result")


def test_a_result_of_markers_alone_gives_marker_pictures_only(result, tmp_path):
    shutil.copytree(result, tmp_path / "result")
    for name in ("points", "poses", "objects"):
        (tmp_path / "result" / f"{name}.jsonl").write_text("")
    assert [path.name for path in plot_result(tmp_path / "result", tmp_path, None)] == [
        "markers_left.png",
        "markers_right.png",
    ]


def test_an_empty_or_missing_result_or_truth(result, tmp_path):
    with pytest.raises(CaptureError, match="no such folder"):
        plot_result(tmp_path / "gone", tmp_path, None)
    with pytest.raises(CaptureError, match=r"no truth\.jsonl"):
        plot_result(result, tmp_path, tmp_path)
    shutil.copytree(result, tmp_path / "result")
    (tmp_path / "result" / "markers.jsonl").write_text("")
    with pytest.raises(CaptureError, match="nothing to draw"):
        plot_result(tmp_path / "result", tmp_path, None)
