"""What the simulator shows is set while it runs: scenes, covered paint, bumped cameras."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.messages.simulator import SimStage
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
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(
    stage: Stage, wanted: SimStage, valid: str
) -> None:
    before = stage.scene, stage.wanted, stage.changes
    with pytest.raises(ConfigError, match=valid):
        stage.set(wanted)
    assert (stage.scene, stage.wanted, stage.changes) == before
