"""What the simulator shows is set while it runs: scenes, covered paint, bumped cameras."""

from __future__ import annotations

import shutil
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot.errors import ConfigError
from rhot.files.calibration import load_rig_cameras
from rhot.files.config import RigConfig
from rhot.messages.simulator import SimBoard, SimStage
from services.simulator.files.calibration_kept import calibration_kept
from services.simulator.render.renderer import Renderer
from services.simulator.stage import Stage


@pytest.fixture(scope="module")
def stage(config: RigConfig) -> Stage:
    return Stage(config)


def test_covered_paint_is_skin_in_every_picture_and_comes_back(stage: Stage) -> None:
    stage.set(SimStage(scene="still"))
    painted = Renderer(stage.seen_by("left"), "left").clean(1.0)
    stage.set(SimStage(scene="still", hidden=["right.index_tip"]))
    scene = stage.seen_by("left")
    covered = Renderer(scene, "left")
    assert ("right", "index_tip") not in covered.shapes.paint_surfaces
    assert ("right", "thumb_tip") in covered.shapes.paint_surfaces
    differ = np.count_nonzero(covered.clean(1.0) != painted)
    # A tip of 14 mm at half a metre is 15 px wide.
    assert 50 < differ < 3000
    stage.set(SimStage(scene="still"))
    again = Renderer(stage.seen_by("left"), "left").clean(1.0)
    np.testing.assert_array_equal(again, painted)


def test_a_bumped_camera_sees_the_hand_elsewhere_while_its_calibration_stays(stage: Stage) -> None:
    stage.set(SimStage(turned_deg={"right": (0.7, 0.0, 0.0)}))
    hand = next(iter(stage.scene.hands.values()))
    point = hand.placement.wrist_m[None]
    was, now = (one.cameras["right"] for one in (stage.scene, stage.seen_by("right")))
    shift = now.project(point) - was.project(point)
    f_px = was.matrix[1, 1]
    assert abs(shift[0, 1]) == pytest.approx(f_px * np.deg2rad(0.7), rel=0.1)
    assert abs(shift[0, 0]) < 1.0
    left = stage.seen_by("left").cameras["left"]
    np.testing.assert_array_equal(
        left.T_rig_from_camera, stage.scene.cameras["left"].T_rig_from_camera
    )


@pytest.mark.parametrize(
    ("wanted", "valid"),
    [
        (SimStage(scene="pinhc"), "pinch"),
        (SimStage(hidden=["right.elbow"]), "right.index_tip"),
        (SimStage(turned_deg={"top": (1.0, 0.0, 0.0)}), "left, right"),
        (SimStage(board=SimBoard(camera="top")), "left, right"),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(
    stage: Stage, wanted: SimStage, valid: str
) -> None:
    before = stage.scene, stage.wanted, stage.changes
    with pytest.raises(ConfigError, match=valid):
        stage.set(wanted)
    assert (stage.scene, stage.wanted, stage.changes) == before


def test_a_hand_waits_and_begins_its_scene_when_it_is_told(stage: Stage) -> None:
    stage.set(SimStage(scene="guided", speed=2.0))
    usual = stage.scene.hands["right"]
    stage.set(SimStage(scene="guided", speed=2.0, begins_in_s=3.0), lambda: 100.0)
    told = stage.scene.hands["right"]
    assert told.speed == 2.0 * stage.scene.config.simulator.speed
    for t_s in (0.0, 1.0, 9.0):
        begun = told.motion(told.speed * (103.0 + t_s)).angles_rad
        np.testing.assert_allclose(begun, usual.motion(usual.speed * t_s).angles_rad, atol=1e-9)
    waiting = told.motion(told.speed * 101.0).angles_rad
    np.testing.assert_array_equal(waiting, usual.motion(0.0).angles_rad)


BOARD = SimStage(board=SimBoard(), lease_s=10.0)


def test_a_lease_lasts_while_it_is_renewed_and_what_was_there_comes_back(stage: Stage) -> None:
    before = SimStage(scene="still", hidden=["right.index_tip"])
    stage.set(before)
    stage.set(BOARD, lambda: 100.0)
    carried = msgspec.structs.replace(BOARD, board=SimBoard(place=1))
    stage.set(carried, lambda: 105.0)
    stage.set(msgspec.structs.replace(BOARD, renews=True), lambda: 114.0)
    stage.end_lease(lambda: 123.9)
    assert (stage.wanted, stage.scene.hands) == (carried, {})
    stage.end_lease(lambda: 124.0)
    assert (stage.wanted, stage.scene.board) == (before, None)
    stage.set(BOARD, lambda: 200.0)
    stage.set(msgspec.structs.replace(BOARD, renews=True, lease_s=0.0), lambda: 201.0)
    assert (stage.wanted, stage.scene.board) == (before, None)


def test_who_renews_changes_nothing_that_somebody_else_has_set(stage: Stage) -> None:
    stage.set(BOARD, lambda: 100.0)
    stage.set(SimStage(scene="still"))
    for lease_s in (10.0, 0.0):
        stage.set(msgspec.structs.replace(BOARD, renews=True, lease_s=lease_s), lambda: 101.0)
    stage.end_lease(lambda: 1000.0)
    assert stage.wanted == SimStage(scene="still")


def test_a_calibration_that_is_saved_meanwhile_does_not_move_the_world(
    config: RigConfig, tmp_path: Path
) -> None:
    written, kept_in = tmp_path / "calibration", tmp_path / "kept"
    shutil.copytree(config.calibration_dir, written)
    kept_in.mkdir()
    rig = msgspec.structs.replace(config, folder=str(tmp_path))
    stage = Stage(rig, calibration_kept(rig, kept_in))
    before = stage.scene.cameras["right"].T_rig_from_camera
    text = (written / "rig.json").read_text(encoding="utf-8")
    (written / "rig.json").write_text(text.replace("0.07419451", "0.08"), encoding="utf-8")
    assert load_rig_cameras(rig)["right"].T_rig_from_camera[0, 3] == 0.08
    stage.set(SimStage(scene="wave"))
    np.testing.assert_array_equal(stage.scene.cameras["right"].T_rig_from_camera, before)
