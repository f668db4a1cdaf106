"""`rhot calibrate stereo` on synthetic rigs: found again, or refused with the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.geometry.transforms import angle_between, inverse
from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import rotated_numberings
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.output.report import rig_text
from services.calibrator.rig.calibrate import calibrate_rig
from services.calibrator.rig.result import RigResult


def place_errors(bench, result: RigResult) -> list[tuple[float, float]]:
    """Error of every camera's place: millimetres and degrees."""
    errors = []
    for k, camera in enumerate(bench.cameras):
        T = inverse(result.state.T_camera_from_rig[k])
        shift = np.linalg.norm(T[:3, 3] - camera.T_rig_from_camera[:3, 3])
        errors.append(
            (1e3 * shift, np.degrees(angle_between(T[:3, :3], camera.T_rig_from_camera[:3, :3])))
        )
    return errors


@pytest.mark.parametrize("cameras", [2, 3])
def test_a_rig_is_found_again(make_bench, cameras):
    bench = make_bench(cameras, positions=9)
    result = calibrate_rig(bench.detections(0.1), bench.board)
    for shift_mm, turn_deg in place_errors(bench, result):
        assert shift_mm < 0.5
        assert turn_deg < 0.15
    np.testing.assert_allclose(
        result.state.lenses[:, 0], [camera.matrix[0, 0] for camera in bench.cameras], rtol=2e-3
    )
    assert result.rms_px == pytest.approx(0.141, rel=0.1)
    assert abs(result.square_ratio - 1.0) < 0.003
    assert result.held_out_px < 0.18
    assert result.cameras == tuple(camera.name for camera in bench.cameras)
    assert "stereo RMS" in rig_text(result)


def test_the_same_pictures_give_the_same_rig(make_bench):
    bench = make_bench(positions=6)
    a, b = (calibrate_rig(bench.detections(0.1), bench.board) for _ in range(2))
    np.testing.assert_array_equal(a.state.T_camera_from_rig, b.state.T_camera_from_rig)
    assert rig_text(a) == rig_text(b)


@pytest.mark.parametrize("size", [(7, 7), (8, 6)])
def test_boards_that_look_the_same_turned_are_numbered_alike(make_bench, size):
    """Test: the second camera begins at any corner of a symmetric board.

    Expected: the cameras agree all the same.
    """
    bench = make_bench(positions=8, board=Board(*size, 0.025))
    found, options = bench.detections(0.1), rotated_numberings(*size)
    for k, key in enumerate(found["right"]):
        found["right"][key] = replace(
            found["right"][key], corners=found["right"][key].corners[options[k % len(options)]]
        )
    result = calibrate_rig(found, bench.board)
    assert place_errors(bench, result)[1][0] < 1.0


def test_partly_seen_charuco_boards_calibrate(make_bench):
    """Test: each camera sees another two thirds of a ChArUco board's corners.

    Expected: the same rig.
    """
    bench = make_bench(positions=9, board=Board(9, 6, 0.025, "charuco", "DICT_4X4_50"))
    generator, parts = np.random.default_rng(1), {}
    for camera, found in bench.detections(0.1).items():
        keep = {key: np.sort(generator.choice(54, 38, replace=False)) for key in found}
        parts[camera] = {
            key: replace(shown, ids=keep[key], corners=shown.corners[keep[key]])
            for key, shown in found.items()
        }
    result = calibrate_rig(parts, bench.board)
    assert place_errors(bench, result)[1][0] < 0.8
    assert all(
        position.held_out
        for position in result.positions
        if all(position.key in found for found in parts.values())
    )


def test_given_lenses_are_kept(make_bench):
    bench = make_bench(positions=8)
    lenses = {
        camera.name: lens_vector(camera.matrix, camera.distortion) for camera in bench.cameras
    }
    result = calibrate_rig(bench.detections(0.1), bench.board, lenses)
    assert result.lenses_given
    np.testing.assert_array_equal(result.state.lenses, np.stack(list(lenses.values())))
    assert place_errors(bench, result)[1][0] < 0.3


def test_cameras_need_not_all_see_every_board(make_bench):
    """Test: the third camera shares boards with the second only.

    Expected: it is joined through the second.
    """
    bench = make_bench(3, positions=13)
    found = bench.detections(0.1)
    keys = list(found["right"])
    found["left"] = {key: shown for key, shown in found["left"].items() if key in keys[:8]}
    found["third"] = {key: shown for key, shown in found["third"].items() if key in keys[7:]}
    result = calibrate_rig(found, bench.board)
    assert all(shift_mm < 1.0 for shift_mm, _ in place_errors(bench, result))


def test_a_board_that_moved_between_the_exposures_is_left_out(make_bench):
    bench = make_bench(positions=12)
    found = bench.detections(0.05)
    key = next(key for key in found["left"] if key in found["right"])
    found["right"][key] = replace(
        found["right"][key], corners=found["right"][key].corners + np.array([0.0, 6.0])
    )
    result = calibrate_rig(found, bench.board)
    assert [item.key for item in result.left_out] == [key]
    assert "did it move" in result.left_out[0].reason
    assert place_errors(bench, result)[1][0] < 0.3


def shifted(found, key_of):
    """The right camera's pictures under other keys."""
    keys = list(found["right"])
    return {
        **found,
        "right": {keys[key_of(k, len(keys))]: found["right"][key] for k, key in enumerate(keys)},
    }


def mirrored(found):
    """The right camera's pictures mirrored, their corners numbered as a detector would."""
    order = np.arange(54).reshape(6, 9)[:, ::-1].reshape(-1)
    flip = np.array([-1.0, 1.0])
    return {
        **found,
        "right": {
            key: replace(shown, corners=(shown.corners * flip + [639.0, 0.0])[order])
            for key, shown in found["right"].items()
        },
    }


def few_in_common(found):
    """The left camera's first eight pictures, the right one's from the seventh."""
    return {
        "left": dict(list(found["left"].items())[:8]),
        "right": dict(list(found["right"].items())[6:]),
    }


def unrelated(found):
    """The right camera's pictures in random order."""
    keys = list(found["right"])
    order = np.random.default_rng(0).permutation(len(keys))
    return {
        **found,
        "right": {key: found["right"][keys[k]] for key, k in zip(keys, order, strict=True)},
    }


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda found: {"left": found["left"]}, "two cameras or more"),
        (lambda found: {**found, "right": {}}, "no picture of 'right' shows the board"),
        (
            lambda found: {**found, "right": dict(list(found["right"].items())[:2])},
            "'right': only 2 usable pictures",
        ),
        (few_in_common, "together"),
        (lambda found: shifted(found, lambda k, n: (k + 1) % n), "paired wrongly"),
        (mirrored, "mirrored"),
        (unrelated, "no position of the second"),
    ],
    ids=[
        "one camera",
        "blind camera",
        "too few",
        "too few in common",
        "paired one off",
        "mirrored",
        "unrelated",
    ],
)
def test_bad_data_are_refused_with_the_reason(make_bench, spoil, reason):
    bench = make_bench(positions=14, depth_m=(0.45, 0.8))
    with pytest.raises(CalibrationError, match=reason):
        calibrate_rig(spoil(bench.detections(0.1)), bench.board)


def test_swapped_names_are_noticed(make_bench):
    bench = make_bench(positions=8)
    found = bench.detections(0.1)
    result = calibrate_rig({"left": found["right"], "right": found["left"]}, bench.board)
    assert any("names swapped" in warning for warning in result.warnings)
