"""The objects of a scene: which wait, which is taken, which is moved through the volume. Pure but
for the files that it reads: calibration/objects.json and the meshes of rig.toml.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rhot.errors import ConfigError
from rhot.files.calibration import ObjectPlace, Objects, load_objects
from rhot.files.config import RigConfig
from rhot.files.shapes import solid_of
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import (
    Array,
    rotation_x,
    rotation_z,
    transform,
)
from rhot.hand import HandName
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
        items[0] = _taken(items[0], *next(iter(hands.items())))
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


def _taken(item: SceneObject, name: HandName, hand: Hand) -> SceneObject:
    """The same object, where a hand takes it."""
    # The y axis of the object lies along the x axis of the hand.
    T_wrist_from_held = transform(rotation_z(-0.5 * np.pi), GRIP_M)
    T_wrist = transform(hand.placement.rotation, hand.placement.wrist_m)
    return SceneObject(
        table=item.table,
        solid=item.solid,
        place=item.place,
        T_rig_from_rest=T_wrist @ T_wrist_from_held,
        holder=name,
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
    return SceneObject(
        table=item.table,
        solid=item.solid,
        place=item.place,
        T_rig_from_rest=way.pose(0.0),
        holder=None,
        T_wrist_from_held=np.eye(4),
        sweep=way,
    )
