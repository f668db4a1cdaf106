"""Makes the calibration of a simulated rig: `python -m services.simulator.files.make_calibration
config/sim.toml`.

Intrinsics, extrinsics, exposure and objects are what a calibration of good cheap cameras would
give; colours are fitted to rendered samples (services/simulator/files/fit_colors.py). Existing
files are replaced: a simulated rig has nothing to lose. The values follow from the cameras' names
and order alone.
"""

from __future__ import annotations

import argparse
import sys
import zlib
from pathlib import Path

import numpy as np

from rhot.errors import RhotError
from rhot.files.calibration import (
    CameraPlace,
    Colors,
    Exposure,
    Lens,
    Objects,
    RigGeometry,
    save,
)
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import CameraTable
from rhot.files.shapes import solid_of
from rhot.geometry.camera import pinhole
from rhot.geometry.transforms import Array, rotation_from_vector, transform
from services.simulator.files.fit_colors import Samples, fit_ranges, sample_pixels
from services.simulator.render.renderer import Renderer
from services.simulator.scene.scene import load_scene
from services.simulator.scene.tracker_mounts import LIGHTHOUSE, simulated_place

# A label that is stored in every calibration file, not a path: it keeps its value, so that files
# made again are the same bytes.
TOOL = "services.simulator.rig"
# RHOT: 62.5 deg over 640 px, cameras 75 mm apart.
_HFOV_RAD = np.deg2rad(62.5)
_BASELINE_M = 0.075
# Barrel distortion of a Raspberry Pi camera's lens after the usual calibration.
_K1, _K2 = -0.055, 0.020

# Scenes and frames that show every paint from many sides, in light and shade.
_SCENES, _FRAMES = ("fist", "piano", "random", "wave"), tuple(range(5, 200, 13))
# And where the rig has objects whose trackers are painted, that paint.
_OBJECT_SCENE = "registration"


def lens(camera: CameraTable, date: str) -> Lens:
    """Intrinsics and distortion of one camera, which differ a little from camera to camera."""
    rng = _rng(camera.name, 1)
    matrix = pinhole(camera.size_px, float(_HFOV_RAD))
    matrix[:2, :2] *= 1.0 + 0.002 * rng.standard_normal()
    matrix[:2, 2] += rng.uniform(-4.0, 4.0, 2) * camera.size_px[0] / 640.0
    k1 = _K1 * rng.uniform(0.9, 1.1)
    k2 = _K2 * rng.uniform(0.9, 1.1)
    p1, p2 = rng.uniform(-5e-4, 5e-4, 2)
    rows = np.round(matrix, 4).tolist()
    distortion = tuple(round(float(d), 6) for d in (k1, k2, p1, p2, 0.0))
    return Lens(
        date=date,
        tool=TOOL,
        size_px=camera.size_px,
        matrix=tuple(tuple(row) for row in rows),  # type: ignore[arg-type]
        distortion=distortion,
    )


def geometry(cameras: list[CameraTable], date: str) -> RigGeometry:
    """Cameras in a row, 75 mm apart.

    Each but the first is turned by up to half a degree about each axis and displaced by up to 1 mm.
    """
    places = {}
    for number, camera in enumerate(cameras):
        rng = _rng(camera.name, 2)
        T = np.eye(4)
        if number:
            error = rng.uniform(-1.0, 1.0, 6)
            T = transform(
                rotation_from_vector(np.deg2rad(0.5) * error[:3]),
                np.array([number * _BASELINE_M, 0.0, 0.0]) + 1e-3 * error[3:],
            )
        places[camera.name] = CameraPlace(T_rig_from_camera=_matrix_rows(T))
    return RigGeometry(date=date, tool=TOOL, cameras=places)


def objects(config: RigConfig, date: str) -> Objects:
    """The pose of the lighthouse frame, and how the trackers are fixed to their objects."""
    places = {o.name: simulated_place(o, solid_of(o, Path(config.folder))) for o in config.object}
    T = _matrix_rows(LIGHTHOUSE)
    return Objects(date=date, tool=TOOL, T_rig_from_lighthouse=T, objects=places)


def write_all(config: RigConfig, date: str = "") -> list[Path]:
    """Write every calibration file of a simulated rig; returns the paths."""
    folder = config.calibration_dir
    written = []

    def put(name: str, calibration: object) -> None:
        save(folder / name, calibration)  # type: ignore[arg-type]
        written.append(folder / name)

    for camera in config.camera:
        put(f"{camera.name}.lens.json", lens(camera, date))
        put(
            f"{camera.name}.exposure.json",
            Exposure(
                date=date, tool=TOOL, exposure_us=8000.0, gain=2.0, red_gain=1.6, blue_gain=1.7
            ),
        )
    put("rig.json", geometry(config.camera, date))
    put("objects.json", objects(config, date))
    for camera in config.camera:
        put(f"{camera.name}.colors.json", colors(config, camera.name, date))
    return written


def colors(config: RigConfig, camera: str, date: str) -> Colors:
    """Ranges of all configured colours, fitted to the pictures that one camera takes of several
    scenes.
    """
    painted: dict[str, list[Samples]] = {}
    others = []
    painted_objects = any(item.marker for item in config.object)
    for name in (*_SCENES, _OBJECT_SCENE) if painted_objects else _SCENES:
        renderer = Renderer(load_scene(config, name), camera)
        surfaces, rest = sample_pixels(renderer, _FRAMES)
        others.append(rest)
        for (hand, landmark), surface in renderer.shapes.paint_surfaces.items():
            color = config.hand[hand].markers[landmark]  # type: ignore[index]
            painted.setdefault(color, []).append(surfaces[surface])
        for item in config.object:
            if item.marker:
                surface = renderer.shapes.marker_surfaces[item.name]
                painted.setdefault(item.marker, []).append(surfaces[surface])
    by_color = {name: np.concatenate(rows) for name, rows in painted.items()}
    return fit_ranges(by_color, np.concatenate(others), date, TOOL)


def _matrix_rows(T: Array) -> tuple:
    return tuple(tuple(round(float(v), 8) for v in row) for row in T)


def _rng(name: str, use: int) -> np.random.Generator:
    return np.random.default_rng([zlib.crc32(name.encode()), use])


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("config", type=Path, help="rig.toml of the simulated rig")
    parser.add_argument("--date", default="", help="date to write into the files")
    options = parser.parse_args()
    try:
        for path in write_all(load_rig(options.config), options.date):
            print(path)
    except RhotError as error:
        sys.exit(f"make_calibration: {error}")


if __name__ == "__main__":
    main()
