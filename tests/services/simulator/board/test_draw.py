"""A printed board in a simulated picture: its corners are where the camera sees them, and nothing
of it is left once it is gone.
"""

from __future__ import annotations

import dataclasses

import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, apply
from rhot.messages.simulator import SimBoard, SimStage
from services.calibrator.board.board import Board, BoardKind
from services.calibrator.board.detect import detect
from services.simulator.board.carried import CarriedBoard
from services.simulator.board.places import place
from services.simulator.board.sheet import COLS, ROWS, SQUARE_M
from services.simulator.render.renderer import Renderer
from services.simulator.scene.scene import Scene
from services.simulator.stage import Stage


@pytest.fixture(scope="module")
def stage(config: RigConfig) -> Stage:
    return Stage(config)


@pytest.mark.parametrize("kind", ["chessboard", "charuco"])
def test_the_calibrator_finds_every_corner_where_it_is(stage: Stage, kind: BoardKind) -> None:
    stage.set(SimStage(board=SimBoard(kind=kind, place=2)))
    board, scene = Board(COLS, ROWS, SQUARE_M, kind), stage.scene
    assert scene.board is not None
    for name in scene.cameras:
        picture = Renderer(scene, name).picture(3)
        found = detect(picture[: scene.cameras[name].size_px[1]], board)
        assert found is not None
        assert len(found.ids) >= 45
        seen = scene.cameras[name].project(apply(scene.board.pose(0.0), board.points))[found.ids]
        # With a camera's noise and blur a corner is found to .05 px.
        assert np.sqrt(np.mean((found.corners - seen) ** 2)) < 0.1


def test_a_board_comes_and_goes_without_a_trace(stage: Stage) -> None:
    stage.set(SimStage())
    before = Renderer(stage.scene, "left").picture(7)
    stage.set(SimStage(board=SimBoard()))
    assert not stage.scene.hands
    shown = Renderer(stage.scene, "left")
    assert np.mean(shown.picture(7) != before) > 0.2
    stage.set(SimStage())
    np.testing.assert_array_equal(Renderer(stage.scene, "left").picture(7), before)


def test_a_board_may_be_all_there_is(config: RigConfig) -> None:
    alone = Stage(msgspec.structs.replace(config, object=()))
    alone.set(SimStage(board=SimBoard(camera="left")))
    assert not alone.scene.hands
    assert not alone.scene.objects
    picture = Renderer(alone.scene, "left").picture(7)
    assert detect(picture[:480], Board(COLS, ROWS, SQUARE_M, "chessboard")) is not None


def test_a_board_that_is_held_still_looks_as_if_drawn_anew(stage: Stage) -> None:
    stage.set(SimStage(board=SimBoard(place=4)))
    kept = Renderer(stage.scene, "left")
    first = kept.picture(5)
    later = kept.picture(6)
    assert not np.array_equal(later, first), "noise"
    np.testing.assert_array_equal(later, Renderer(stage.scene, "left").picture(6))
    # Elsewhere nothing of its old place is left.
    stage.set(SimStage(board=SimBoard(place=5)), lambda: 1.0)
    np.testing.assert_array_equal(kept.picture(90), Renderer(stage.scene, "left").picture(90))


def blurred_px(scene: Scene, path: CarriedBoard, frame: int) -> float:
    """Width of the board's upright edges in a picture: grey pixels a row."""
    renderer = Renderer(dataclasses.replace(scene, board=path), "left")
    luma = renderer.clean(renderer.clock.time_s(frame))[200:280].astype(float)
    steep = np.abs(np.diff(luma, axis=1))
    return float(np.mean(steep > 4.0)) * luma.shape[1]


def test_a_board_that_moves_is_smeared(stage: Stage) -> None:
    stage.set(SimStage(board=SimBoard()))
    scene = stage.scene
    cameras = list(scene.cameras.values())
    T: Array = place(cameras, 0, 1)
    there = T.copy()
    there[0, 3] += 0.3
    path = CarriedBoard("chessboard", T)
    moving = CarriedBoard("chessboard", T)
    frame = 20
    moving.carry(there, scene.clocks["left"].time_s(frame) - 0.35)
    assert blurred_px(scene, moving, frame) > 1.3 * blurred_px(scene, path, frame)
