"""`rhot calibrate lens` on synthetic views: found again, or refused with the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.lens.calibrate import calibrate_lens
from services.calibrator.output.report import lens_text


@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.3, 0.1, 0.001, -0.001, 0.0)])
def test_a_lens_is_found_again(make_bench, distortion):
    bench = make_bench(1, positions=12, distortion=distortion)
    result = calibrate_lens("left", bench.detections(0.1)["left"], bench.board)
    true = lens_vector(bench.cameras[0].matrix, bench.cameras[0].distortion)
    np.testing.assert_allclose(result.lens[:2], true[:2], rtol=3e-3)
    np.testing.assert_allclose(result.lens[2:4], true[2:4], atol=2.5)
    assert np.abs((result.lens - true)[:4] / result.sigma[:4]).max() < 4.0
    assert result.rms_px == pytest.approx(0.141, rel=0.15)
    assert result.held_out_px < 0.17
    assert result.held_out_squares < 0.01
    assert ("no distortion" in result.model) == (distortion[0] == 0.0)
    text = lens_text(result, bench.board)
    assert "held out" in text
    assert "hurts" not in text


def test_partly_seen_boards_calibrate(make_bench):
    """Test: every view lacks a third of its corners, each another third, as with ChArUco boards.

    Expected: the same lens.
    """
    bench = make_bench(1, positions=12)
    generator = np.random.default_rng(3)
    parts = {}
    for key, found in bench.detections(0.1)["left"].items():
        keep = np.sort(generator.choice(54, 36, replace=False))
        parts[key] = replace(found, ids=keep, corners=found.corners[keep])
    result = calibrate_lens("left", parts, bench.board)
    assert result.lens[0] == pytest.approx(527.3, rel=4e-3)


def test_pictures_that_contradict_are_left_out_and_named(make_bench):
    """Test: one picture's corners are wrong, another is of other size.

    Expected: both named, the lens unharmed.
    """
    bench = make_bench(1, positions=12)
    found = bench.detections(0.05)["left"]
    bad, other = list(found)[3], list(found)[5]
    wild = np.random.default_rng(0).normal(0.0, 3.0, found[bad].corners.shape)
    found[bad] = replace(found[bad], corners=found[bad].corners + wild)
    found[other] = replace(found[other], size_px=(320, 240))
    result = calibrate_lens("left", found, bench.board)
    assert {item.key for item in result.left_out} == {bad, other}
    assert "320x240" in next(item.reason for item in result.left_out if item.key == other)
    assert result.lens[0] == pytest.approx(527.3, rel=3e-3)
    assert "left out: left" in lens_text(result, bench.board)


def test_a_picture_that_hurts_is_marked(make_bench):
    """Test: a board bent in one picture, too little to be left out.

    Expected: it is marked, and the report says so.
    """
    bench = make_bench(1, positions=10)
    found = bench.detections(0.05)["left"]
    key = list(found)[2]
    found[key] = replace(
        found[key], corners=found[key].corners + 0.1 * (bench.board.grid - [4.0, 2.5]) ** 2
    )
    result = calibrate_lens("left", found, bench.board)
    assert key in [picture.key for picture in result.pictures if picture.suspect]
    assert sum(picture.suspect for picture in result.pictures) <= 2
    assert "<- hurts" in lens_text(result, bench.board)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"positions": 3}, "only 3 usable pictures"),
        ({"tilt_deg": 4.0}, "about the same angle|never tilted"),
        ({"spread": 0.0, "depth_m": (1.2, 1.3), "positions": 8}, "corners cover"),
    ],
)
def test_data_that_cannot_support_a_calibration_are_refused_with_the_reason(
    make_bench, arguments, reason
):
    bench = make_bench(1, **arguments)
    with pytest.raises(CalibrationError, match=reason) as refused:
        calibrate_lens("left", bench.detections(0.1)["left"], bench.board)
    assert "tilted 20 to 45 degrees" in str(refused.value)


def test_no_picture_at_all_is_refused(make_bench):
    with pytest.raises(CalibrationError, match="only 0 usable pictures"):
        calibrate_lens("left", {}, make_bench(1).board)


def test_a_board_counted_wrongly_is_refused(make_bench):
    """Test: corners of a board that is not a regular grid, as after --board with swapped numbers.

    Expected: no lens explains it.
    """
    bench = make_bench(1, positions=10)
    found = {
        key: replace(shown, corners=shown.corners)
        for key, shown in bench.detections(0.05)["left"].items()
    }
    with pytest.raises(CalibrationError, match="no lens explains"):
        calibrate_lens("left", found, Board(6, 9, 0.025))
