"""What the viewer reads before it starts: cameras and paints, with a note for whatever is missing.

A camera that is not calibrated, or whose calibration file is broken, is shown without a frustum:
the note says which and what to run.
"""

from __future__ import annotations

from dataclasses import dataclass

from rhot.errors import CalibrationError
from rhot.files.calibration import Colors, load_colors, load_rig_cameras
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.hand import HandName
from services.viewer.live.palette import Rgb, paint_rgb


@dataclass(frozen=True)
class Setup:
    """Everything of the rig that does not come over the bus."""

    cameras: dict[str, Camera]
    paints: dict[tuple[HandName, str], Rgb]
    notes: list[str]


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
    return Setup(cameras, paints, notes)


def _short(error: CalibrationError, config: RigConfig) -> str:
    """The error without the folder, which the panel has no room for."""
    return str(error).replace(f"{config.calibration_dir}/", "")
