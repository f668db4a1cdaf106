"""The objects of a scene: which wait, which is taken, which is moved through the volume. Pure but
for the files that it reads: calibration/objects.json and the meshes of rig.toml.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from rhot.errors import ConfigError
from rhot.files.calibration import ObjectPlace, Objects, load_objects
from rhot.files.config import RigConfig
from rhot.files.shapes import solid_of
from rhot.geometry.camera import Camera
from rhot.geometry.solids import Solid
from rhot.geometry.transforms import (
    Array,
    rotation_x,
    rotation_z,
    transform,
)
from rhot.hand import HandName
from services.simulator.hands.grasps import grasp, timing
from services.simulator.hands.holds import Grip, hold
from services.simulator.scene.actors import GRIP_M, Hand, SceneObject, middle_of_cameras
from services.simulator.scene.catalog import SceneSpec, SweepSpec
from services.simulator.scene.sweep import Sweep, sweep
from services.simulator.scene.tracker_mounts import (
    LIGHTHOUSE,
    bead_m,
    believed,
    is_puck,
    simulated_place,
)

# A held object's axis lies obliquely across the palm: at 0.5 rad the thumb presses against the
# fingers (their normals' cosine is -0.97), at 0.25 on the object's end (-0.4).
_TILT_RAD = (0.42, 0.58)


def place_objects(
    config: RigConfig,
    spec: SceneSpec,
    hands: dict[HandName, Hand],
    cameras: dict[str, Camera],
    seed: int,
) -> tuple[Array, list[SceneObject]]:
    """T_rig_from_lighthouse (4, 4), and every object of rig.toml.

    Raises ConfigError (a scene that moves an object, and there is none; a wrong shape) and
    CalibrationError (a mesh that cannot be read).
    """
    if spec.sweep is not None and not config.object:
        raise ConfigError(
            "this scene moves an object; add an [[object]] table with name, serial and marker"
            " (the colour of the paint on its tracker) to rig.toml"
        )
    known = _truth_file(config)
    items = [
        _resting(config, spec, number, len(hands), known, cameras)
        for number in range(len(config.object))
    ]
    if items and spec.sweep is not None:
        items[0] = _swept(items[0], spec.sweep, list(cameras.values()), seed)
    elif items and hands and spec.motion == "grab":
        name = next(iter(hands))
        solid = items[0].solid
        if solid is None:
            items[0] = _taken(items[0], hands[name])
        else:
            items[0], hands[name] = _grasped(items[0], solid, hands[name], spec, seed)
    T = LIGHTHOUSE if known is None else np.array(known.T_rig_from_lighthouse)
    return T, items


def _truth_file(config: RigConfig) -> Objects | None:
    folder = config.calibration_dir
    return believed(load_objects(folder) if Path(folder, "objects.json").exists() else None)


def _resting(
    config: RigConfig,
    spec: SceneSpec,
    number: int,
    hands: int,
    known: Objects | None,
    cameras: dict[str, Camera],
) -> SceneObject:
    """An object that waits: beside one hand or between two, a little behind, turned a little."""
    table = config.object[number]
    solid = solid_of(table, Path(config.folder))
    place = simulated_place(table, solid)
    if known is not None:
        place = known.objects.get(table.name, ObjectPlace())
    x_m = (0.17 if hands < 2 else 0.05) - 0.11 * number
    # A puck stands on top of its object.
    upright = rotation_z(0.1) if is_puck(table) else rotation_x(np.pi) @ rotation_z(0.1)
    T_view_from_object = transform(upright, (x_m, 0.10, spec.distance_m + 0.12))
    first = next(iter(cameras.values()))
    return SceneObject(
        table=table,
        solid=solid,
        place=place,
        T_rig_from_rest=first.T_rig_from_camera @ T_view_from_object,
        holder=None,
        T_wrist_from_held=np.eye(4),
    )


def _grasped(
    item: SceneObject, solid: Solid, hand: Hand, spec: SceneSpec, seed: int
) -> tuple[SceneObject, Hand]:
    """An object where a hand takes it, and the hand, which closes until its digits touch."""
    rng = np.random.default_rng([seed, 47])
    grip = Grip(gap_m=spec.pass_by_m, tilt_rad=float(rng.uniform(*_TILT_RAD)))
    held = hold(hand.model, solid, grip)
    carry = not spec.pass_by_m
    T_wrist = transform(hand.placement.rotation, hand.placement.wrist_m)
    placed = replace(
        item,
        T_rig_from_rest=T_wrist @ held.T_wrist_from_object,
        holder=hand.name if carry else None,
        T_wrist_from_held=held.T_wrist_from_object,
    )
    return placed, replace(hand, motion=grasp(held, timing(seed, carry=carry)))


def _taken(item: SceneObject, hand: Hand) -> SceneObject:
    """An object without a shape, where a hand takes it."""
    # The y axis of the object lies along the x axis of the hand.
    T_wrist_from_held = transform(rotation_z(-0.5 * np.pi), GRIP_M)
    T_wrist = transform(hand.placement.rotation, hand.placement.wrist_m)
    return replace(
        item,
        T_rig_from_rest=T_wrist @ T_wrist_from_held,
        holder=hand.name,
        T_wrist_from_held=T_wrist_from_held,
    )


def _swept(item: SceneObject, spec: SweepSpec, cameras: list[Camera], seed: int) -> SceneObject:
    """The same object on its way through the volume."""
    T_first_from_view = transform(np.eye(3), middle_of_cameras(cameras))
    way: Sweep = sweep(
        spec,
        cameras[0].T_rig_from_camera @ T_first_from_view,
        item.T_object_from_tracker,
        np.array(bead_m(item.place)),
        seed,
    )
    return replace(item, T_rig_from_rest=way.pose(0.0), sweep=way)
