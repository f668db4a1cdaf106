"""The world frame from a board that lies on the desk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.geometry.transforms import apply, rotation_x, rotation_z, transform
from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import rotated_numberings
from services.calibrator.board.detect import Detection
from services.calibrator.rig.world_frame import find_world_frame

# A board seen by cameras that look down at the desk under 40 degrees.
LYING = transform(rotation_x(np.radians(-40.0)) @ rotation_z(0.2), [-0.08, -0.02, 0.55])


@pytest.fixture
def desk_bench(make_bench):
    """A bench with one board on the desk, and what its cameras see of it."""

    def make(board: Board):
        bench = replace(make_bench(board=board), poses={"desk": LYING})
        seen = {
            c.name: Detection(np.arange(board.size), bench.corners(c, "desk"), c.size_px)
            for c in bench.cameras
        }
        return {camera.name: camera for camera in bench.cameras}, seen

    return make


@pytest.mark.parametrize("who", [("left",), ("left", "right"), ("right",)])
def test_the_desk_is_found_by_any_cameras(desk_bench, who):
    board = Board(9, 6, 0.025)
    cameras, seen = desk_bench(board)
    world = find_world_frame(cameras, {name: seen[name] for name in who}, board)
    assert world.cameras == who
    assert world.rms_px < 1e-3
    on_desk = apply(world.T_world_from_rig, apply(LYING, board.points))
    np.testing.assert_allclose(on_desk[:, 2], 0.0, atol=1e-6)
    np.testing.assert_allclose(on_desk[1], [0.025, 0.0, 0.0], atol=1e-6)
    assert apply(world.T_world_from_rig, [0.0, 0.0, 0.0])[2] > 0.2


def test_a_symmetric_board_is_numbered_alike(desk_bench):
    board = Board(8, 6, 0.025)
    cameras, seen = desk_bench(board)
    seen["right"] = replace(
        seen["right"], corners=seen["right"].corners[rotated_numberings(8, 6)[1]]
    )
    assert find_world_frame(cameras, seen, board).rms_px < 1e-3


def test_what_cannot_be_the_desk_is_refused(desk_bench):
    board = Board(9, 6, 0.025)
    cameras, seen = desk_bench(board)
    with pytest.raises(CalibrationError, match="no camera sees"):
        find_world_frame(cameras, {}, board)
    with pytest.raises(CalibrationError, match="calibrated at"):
        find_world_frame(cameras, {"left": replace(seen["left"], size_px=(320, 240))}, board)
    moved = {
        **seen,
        "right": replace(seen["right"], corners=seen["right"].corners + np.array([0.0, 12.0])),
    }
    with pytest.raises(CalibrationError, match="was a camera moved"):
        find_world_frame(cameras, moved, board)
