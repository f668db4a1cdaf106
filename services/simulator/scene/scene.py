"""A scene: hands, objects and cameras as pure functions of time.

`load_scene` builds one from rig.toml. The same configuration, name, random seed and speed always
give the same scene. Times are seconds on the master's clock since the scene began. The hands have
the bones of calibration/hand.<hand>.json, or of the tables. Cameras without calibration are a
CalibrationError that names the command, an unknown scene or paint is a ConfigError that lists the
valid ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.errors import CalibrationError, ConfigError
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import HANDS, HandModel, HandName
from rhot.messages.simulator import Truth
from services.simulator.board.carried import CarriedBoard
from services.simulator.camera_clock import CameraClock, camera_clock
from services.simulator.hands.calibration_exercises import guided
from services.simulator.hands.gestures import MOTIONS
from services.simulator.hands.hand_kinematics import Skeleton
from services.simulator.hands.involuntary_motion import InvoluntaryMotion
from services.simulator.scene.actors import (
    Hand,
    HandPlacement,
    HandState,
    PalmView,
    SceneObject,
    Travel,
    lateral_offset_m,
    middle_of_cameras,
    place_hand,
)
from services.simulator.scene.catalog import SceneSpec, scene_spec
from services.simulator.scene.scene_objects import place_objects
from services.simulator.scene.truth import truth_message


class BodyFrames(NamedTuple):
    """All f body frames at one instant, in the rig frame.

    Of each hand 26 joints and the forearm, then the objects.
    """

    positions: Array  # (f, 3) m
    rotations: Array  # (f, 3, 3)


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that moves, and the cameras that see it.

    cameras and clocks are keyed by camera name, in the order of rig.toml.
    """

    config: RigConfig
    name: str
    seed: int
    spec: SceneSpec
    hands: dict[HandName, Hand]
    objects: list[SceneObject]
    cameras: dict[str, Camera]
    clocks: dict[str, CameraClock]
    T_rig_from_lighthouse: Array  # (4, 4)
    # Somebody shows a calibration board; there are no hands then.
    board: CarriedBoard | None = None

    def hand_states(self, t_s: float) -> dict[HandName, HandState]:
        """Every hand at one instant."""
        return {name: hand.state_at(t_s) for name, hand in self.hands.items()}

    def object_poses(self, t_s: float) -> dict[str, Array]:
        """T_rig_from_object (4, 4) of every object."""
        states = self.hand_states(t_s)
        return {item.name: item.pose_at(t_s, states) for item in self.objects}

    def body_frames(self, t_s: float) -> BodyFrames:
        """All body frames at one instant, for the renderer."""
        states = self.hand_states(t_s)
        # Nobody may be there: who shows a board has no hand free.
        positions, rotations = [np.empty((0, 3))], [np.empty((0, 3, 3))]
        for name, state in states.items():
            p, R = self.hands[name].joints(state)
            positions += [p, state.wrist_m[None]]
            rotations += [R, state.arm_rotation[None]]
        for item in self.objects:
            T = item.pose_at(t_s, states)
            positions.append(T[None, :3, 3])
            rotations.append(T[None, :3, :3])
        return BodyFrames(np.concatenate(positions), np.concatenate(rotations))

    def truth(self, t_s: float, stamp_ns: int | None = None) -> Truth:
        """The ground truth at one instant.

        stamp_ns is that instant on the master's clock (default: the scene began at 0).
        """
        states = self.hand_states(t_s)
        objects = {item.name: item.pose_at(t_s, states) for item in self.objects}
        stamp_ns = round(t_s * 1e9) if stamp_ns is None else stamp_ns
        return truth_message(self.hands, states, self.objects, objects, stamp_ns)


def load_scene(
    config: RigConfig, name: str | None = None, seed: int | None = None, speed: float | None = None
) -> Scene:
    """A named scene for the rig of `config`; what is None comes from its [simulator] table.

    Raises ConfigError (unknown scene or paint, nothing to show) and CalibrationError (cameras
    without lens or place).
    """
    settings = config.simulator
    name = settings.scene if name is None else name
    return build_scene(
        config,
        scene_spec(name),
        name,
        settings.seed if seed is None else seed,
        settings.speed if speed is None else speed,
    )


def build_scene(
    config: RigConfig,
    spec: SceneSpec,
    name: str,
    seed: int,
    speed: float = 1.0,
    models: dict[HandName, HandModel] | None = None,
) -> Scene:
    """A scene that is in no catalogue, e.g. dataclasses.replace(SCENES["wave"], distance_m=1.0).

    models are hands other than those of the calibration files. Errors as load_scene.
    """
    if not config.camera:
        raise ConfigError("the simulator needs at least one [[camera]] in rig.toml")
    cameras = rig_cameras(config)
    models = _models(config, spec) if models is None else models
    hands = _hands(config, spec, seed, speed, list(cameras.values()), models)
    T_rig_from_lighthouse, objects = place_objects(config, spec, hands, cameras, seed)
    count = len(config.camera)
    clocks = {
        table.name: camera_clock(table, number, count, spec.exposure_s, seed)
        for number, table in enumerate(config.camera)
    }
    return Scene(
        config=config,
        name=name,
        seed=seed,
        spec=spec,
        hands=hands,
        objects=objects,
        cameras=cameras,
        clocks=clocks,
        T_rig_from_lighthouse=T_rig_from_lighthouse,
    )


def rig_cameras(config: RigConfig) -> dict[str, Camera]:
    """Every camera of rig.toml in the rig frame, with [rig.world] applied.

    The picture size must be the calibrated one.
    """
    cameras = load_rig_cameras(config)
    for table in config.camera:
        size = cameras[table.name].size_px
        if size != table.size_px:
            raise CalibrationError(
                f"camera {table.name!r}: rig.toml says size_px = {list(table.size_px)}, its lens"
                f" was calibrated at {list(size)}; set the same size, or run `python -m"
                " services.simulator.files.make_calibration` for a simulated rig"
            )
        if table.size_px[0] % 2 or table.size_px[1] % 2:
            raise ConfigError(
                f"camera {table.name!r}: size_px = {list(table.size_px)};"
                " YUV420 pictures need even sizes"
            )
    return cameras


def _models(config: RigConfig, spec: SceneSpec) -> dict[HandName, HandModel]:
    """The hands that the calibration files or the tables describe, and the scene has."""
    if spec.sweep is not None:
        return {}
    names = [name for name in HANDS if name in config.hand or name in spec.extra_hands]
    if not names:
        raise ConfigError(
            "the simulator needs a hand; add a [hand.right.markers] table to rig.toml,"
            ' e.g. index_tip = "blue"'
        )
    scales = {name: table.scale for name, table in config.hand.items()}
    return {name: load_hand(config.calibration_dir, name, scales.get(name, 1.0)) for name in names}


def _hands(
    config: RigConfig,
    spec: SceneSpec,
    seed: int,
    speed: float,
    cameras: list[Camera],
    models: dict[HandName, HandModel],
) -> dict[HandName, Hand]:
    hands: dict[HandName, Hand] = {}
    for name, model in models.items():
        table = config.hand.get(name)
        hand_seed = seed_of_hand(seed, name)
        make_motion = guided if spec.motion == "guided" else MOTIONS[spec.motion]
        hands[name] = Hand(
            name=name,
            model=model,
            skeleton=Skeleton(model),
            landmarks=dict(table.markers) if table else {},
            motion=make_motion(model, hand_seed),
            involuntary=InvoluntaryMotion(hand_seed),
            placement=hand_placement(spec, name, len(models), hand_seed, cameras),
            speed=spec.speed * speed,
        )
    return hands


def seed_of_hand(seed: int, name: HandName) -> int:
    """Of its motion and place: each hand of a scene has another."""
    return seed * len(HANDS) + HANDS.index(name)


def hand_placement(
    spec: SceneSpec, name: HandName, hands: int, seed: int, cameras: list[Camera]
) -> HandPlacement:
    """A hand in front of the middle of the rig; every seed gives a slightly different place."""
    T_view = cameras[0].T_rig_from_camera
    middle_view = middle_of_cameras(cameras)
    rng = np.random.default_rng([seed, 5])
    off_m = rng.uniform(-0.008, 0.008, 3)
    off_deg = rng.uniform(-3.0, 3.0, 3)
    aside_m = spec.shift_m[0] + lateral_offset_m(name, hands)
    middle = middle_view + np.array([aside_m, spec.shift_m[1], spec.distance_m]) + off_m
    mirror = 1.0 if name == "right" else -1.0
    view = PalmView(
        tilt_deg=spec.tilt_deg + off_deg[0],
        yaw_deg=mirror * (spec.yaw_deg + off_deg[1]),
        roll_deg=mirror * (spec.roll_deg + off_deg[2]),
    )
    return place_hand(T_view, middle, view, Travel(spec.travel_m, spec.travel_hz))
