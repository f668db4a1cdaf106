"""The scene of a case: one hand before the simulator's cameras, with a motion of its own. Pure."""

from __future__ import annotations

import dataclasses

from rhot.files.config import RigConfig
from rhot.hand import HandModel
from services.simulator.hands.gestures import Motion
from services.simulator.recorded_motion.before_cameras import RecordedGesture
from services.simulator.recorded_motion.playback import Playback
from services.simulator.scene.actors import MIDDLE_M
from services.simulator.scene.catalog import SceneSpec
from services.simulator.scene.scene import Scene, build_scene
from testing.families.picture_motions import Moves
from testing.families.recordings import leap_hand


def staged(
    config: RigConfig, spec: SceneSpec, model: HandModel, motion: Moves | str, seed: int
) -> Scene:
    """A scene with this hand alone; motion: a gesture's, or a Leap recording's name."""
    scene = build_scene(config, spec, "families", seed, models={model.hand: model})
    moved = dataclasses.replace(scene.hands[model.hand], motion=_moving(motion, model, seed))
    return dataclasses.replace(scene, hands={model.hand: moved})


def _moving(motion: Moves | str, model: HandModel, seed: int) -> Motion:
    if isinstance(motion, Moves):
        return motion.motion(model, 2 * seed + 1)
    driven = leap_hand(motion)
    playback = Playback(float(driven.times_s[-1]), to_and_fro=True)
    return RecordedGesture(driven, playback, MIDDLE_M)
