"""Calibration files of cameras that are known exactly, for tests with processes of their own."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rhot.files.calibration import CameraPlace, Lens, RigGeometry, lens_kind, save
from rhot.geometry.camera import Camera


def lens_of(camera: Camera) -> Lens:
    """The content of <camera>.lens.json."""
    return Lens(
        size_px=camera.size_px,
        matrix=tuple(tuple(row) for row in camera.matrix.tolist()),
        distortion=tuple(camera.distortion.tolist()),
        model=lens_kind(camera.distortion),
    )


def save_calibration(folder: Path, cameras: Iterable[Camera]) -> None:
    """Write every camera's lens and rig.json into the folder."""
    places = {}
    for camera in cameras:
        save(folder / f"{camera.name}.lens.json", lens_of(camera))
        pose = tuple(tuple(row) for row in camera.T_rig_from_camera.tolist())
        places[camera.name] = CameraPlace(T_rig_from_camera=pose)
    save(folder / "rig.json", RigGeometry(cameras=places))
