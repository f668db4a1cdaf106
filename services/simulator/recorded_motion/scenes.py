"""A recording as a scene: a hand with its bones before the cameras, or its points alone. Pure.

What is done follows from the recording: where bones fit, a hand is rendered; where none fit (marks
on a glove), there is nothing to render, and what is left is where each camera would see the points.
The painted landmarks of both are those of rig.toml; a recording of the hand that rig.toml lacks
takes over the other one's paint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS, HandName
from services.simulator.camera_clock import CameraClock, camera_clock
from services.simulator.recorded_motion.before_cameras import RecordedGesture, RecordedMotion
from services.simulator.recorded_motion.bones import DrivenHand, driven_hand
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.playback import Playback
from services.simulator.recorded_motion.recording import RecordedJoints, RecordedPoints
from services.simulator.scene.actors import MIDDLE_M
from services.simulator.scene.catalog import SceneSpec
from services.simulator.scene.scene import (
    Scene,
    build_scene,
    hand_placement,
    load_scene,
    rig_cameras,
    seed_of_hand,
)

# How far the cameras look from the wrist's side, on the average of the recording.
_TILT_DEG = 20.0


@dataclass(frozen=True)
class MotionView:
    """How a recording is shown.

    seconds: for so long, to and fro where the recording is shorter; None: for ever. distance_m: of
    the middle of the hand from the cameras. speed: 2 shows it in half the time.
    """

    seconds: float | None = None
    distance_m: float = 0.5
    speed: float = 1.0
    seed: int = 1


@dataclass(frozen=True, eq=False)
class PointScene:
    """Points that move before the cameras of a rig, without anything that could be rendered.

    motion gives wrist and tips (n, 6, 3) in the rig frame at times (n,) or (n, 6), NaN where the
    recording lacks one; colors are their paints, "" for one that rig.toml does not paint.
    """

    config: RigConfig
    hand: HandName
    seed: int
    motion: RecordedMotion
    colors: tuple[str, ...]
    cameras: dict[str, Camera]
    clocks: dict[str, CameraClock]


def load_motion(path: Path) -> DrivenHand | RecordedPoints:
    """The recording at path: a hand where bones fit it, else points. Raises CaptureError."""
    recorded = load_recording(path)
    return driven_hand(recorded) if isinstance(recorded, RecordedJoints) else recorded


def recorded_scene(config: RigConfig, driven: DrivenHand, view: MotionView) -> Scene:
    """The rendered hand. Errors as of services/simulator/scene/scene.py."""
    config = _with_hand(config, driven.hand)
    models = {driven.hand: driven.model}
    scene = build_scene(config, _spec(view), "recorded", view.seed, view.speed, models)
    motion = RecordedGesture(driven, _playback(driven.times_s, view), MIDDLE_M)
    hand = replace(scene.hands[driven.hand], motion=motion)
    return replace(scene, hands={driven.hand: hand})


def live_scene(config: RigConfig) -> Scene:
    """What [simulator] of rig.toml asks for: a named scene, or a recorded hand.

    Raises ConfigError for a recording that has nothing to render, CaptureError for none.
    """
    settings = config.simulator
    if not settings.motion:
        return load_scene(config)
    path = Path(config.folder) / settings.motion
    driven = load_motion(path)
    if isinstance(driven, RecordedPoints):
        raise ConfigError(
            f"[simulator] motion = {settings.motion!r}: no bones fit that recording, so there is"
            " nothing to render live; `rhot simulate --motion` writes its markers"
        )
    view = MotionView(None, settings.motion_distance_m, settings.speed, settings.seed)
    return recorded_scene(config, driven, view)


def point_scene(
    config: RigConfig, recorded: DrivenHand | RecordedPoints, view: MotionView
) -> PointScene:
    """The points alone, of any recording."""
    config = _with_hand(config, recorded.hand)
    cameras, spec = rig_cameras(config), _spec(view)
    hand_seed = seed_of_hand(view.seed, recorded.hand)
    place = hand_placement(spec, recorded.hand, 1, hand_seed, list(cameras.values()))
    markers = config.hand[recorded.hand].markers
    return PointScene(
        config=config,
        hand=recorded.hand,
        seed=view.seed,
        motion=RecordedMotion(
            recorded,
            _playback(recorded.times_s, view),
            place.rotation,
            place.wrist_m + place.rotation @ MIDDLE_M,
            view.speed,
        ),
        colors=tuple(markers.get(name, "") for name in BASIC_LANDMARKS),
        cameras=cameras,
        clocks={
            table.name: camera_clock(table, number, len(config.camera), spec.exposure_s, view.seed)
            for number, table in enumerate(config.camera)
        },
    )


def _spec(view: MotionView) -> SceneSpec:
    return SceneSpec(
        "still",
        "a recording",
        distance_m=view.distance_m,
        tilt_deg=_TILT_DEG,
        yaw_deg=0.0,
        roll_deg=0.0,
    )


def _playback(times_s: Array, view: MotionView) -> Playback:
    span_s = float(times_s[-1])
    return Playback(span_s, view.seconds is None or view.seconds * view.speed > span_s + 1e-9)


def _with_hand(config: RigConfig, hand: HandName) -> RigConfig:
    """A rig with that hand alone."""
    if not config.hand:
        raise ConfigError(
            "a recorded motion needs a hand; add a [hand.right.markers] table to rig.toml, e.g."
            ' index_tip = "blue"'
        )
    table = config.hand.get(hand) or next(iter(config.hand.values()))
    return msgspec.structs.replace(config, hand={hand: table})
