"""What the viewer reads before it starts: cameras, paints and the looks of objects, with a note for
whatever is missing.

A camera that is not calibrated, or whose calibration file is broken, is shown without a frustum,
an object whose mesh cannot be read as its axes: the note says which and what to do.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

from rhot.errors import CalibrationError, ConfigError
from rhot.files.calibration import (
    Colors,
    ObjectPlace,
    load_colors,
    load_hand,
    load_objects,
    load_rig_cameras,
)
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.hand import HandModel, HandName
from services.viewer.live.palette import Rgb, paint_rgb
from services.viewer.scene.object_looks import ObjectLook, read_mesh


@dataclass(frozen=True)
class Setup:
    """Everything of the rig that does not come over the bus."""

    cameras: dict[str, Camera]
    paints: dict[tuple[HandName, str], Rgb]
    looks: dict[str, ObjectLook]
    notes: list[str]
    # Of each hand, for the limits of its joints: as measured, or of the tables.
    models: dict[HandName, HandModel]


def read_setup(config: RigConfig) -> Setup:
    """Cameras and paints of a rig, never an error."""
    cameras: dict[str, Camera] = {}
    colors: list[Colors] = []
    notes: list[str] = []
    for table in config.camera:
        try:
            cameras |= load_rig_cameras(config, [table.name])
        except CalibrationError as error:
            notes.append(f"camera {table.name} is not drawn: {_short(error, config)}")
        try:
            colors.append(load_colors(config.calibration_dir, table.name))
        except CalibrationError:
            # Paints have names; pi_tracker reports colours that are not calibrated.
            continue
    paints: dict[tuple[HandName, str], Rgb] = {
        (hand, landmark): paint_rgb(color, colors)
        for hand, markers in config.hand.items()
        for landmark, color in markers.markers.items()
    }
    return Setup(cameras, paints, _looks(config, notes), notes, _models(config, notes))


def _models(config: RigConfig, notes: list[str]) -> dict[HandName, HandModel]:
    """Each hand's model; notes of files that cannot be read are added."""
    models = {}
    for hand in config.hand:
        try:
            models[hand] = load_hand(config.calibration_dir, hand)
        except CalibrationError as error:
            notes.append(f"the limits of the {hand} hand are an average's: {_short(error, config)}")
    return models


def _looks(config: RigConfig, notes: list[str]) -> dict[str, ObjectLook]:
    """How each object looks; notes of meshes that cannot be drawn are added."""
    places: dict[str, ObjectPlace] = {}
    # Without the file nothing is registered, which the panel says of each object.
    with contextlib.suppress(CalibrationError):
        places = load_objects(config.calibration_dir).objects
    looks = {}
    for table in config.object:
        mesh = None
        if table.shape == "mesh":
            try:
                mesh = read_mesh(Path(config.folder) / table.mesh)
            except ConfigError as error:
                notes.append(f"object {table.name} is drawn as axes: {error}")
        looks[table.name] = ObjectLook(table, mesh, places.get(table.name))
    return looks


def _short(error: CalibrationError, config: RigConfig) -> str:
    """The error without the folder, which the panel has no room for."""
    return str(error).replace(f"{config.calibration_dir}/", "")
