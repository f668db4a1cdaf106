"""Whether calibration/ holds what this machine needs of it, and whether that fits rig.toml: lenses,
extrinsics, hands, objects; colours and exposures are in colors.py.

Every missing or broken file is reported with the command that makes it; a hand nobody has measured
is a note, since tables stand in.
"""

from __future__ import annotations

from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np

from rhot.files.calibration import (
    Objects,
    load_cameras,
    load_geometry,
    load_hand,
    load_lens,
    load_objects,
)
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from rhot.geometry.camera import Camera
from services.cli.check.colors import check_colors, check_exposure
from services.cli.check.problems import Problem, error, load_or_report, note, warning
from services.cli.check.shapes import check_shapes
from services.cli.rig.place import Place

# Depth error grows as 1 / baseline: at 20 mm and 0.6 m it is 34 mm per pixel, which no filter mends
# (9.1 mm at 75 mm).
_MIN_BASELINE_M = 0.020


def check_calibration(config: RigConfig, place: Place) -> list[Problem]:
    """Problems of the files under calibration/ that the services of this machine load."""
    problems: list[Problem] = []
    for camera in config.camera:
        if camera.name in place.cameras:
            problems += check_colors(config, camera) + check_exposure(config, camera)
        # A tracker that rectifies pictures needs its lens, too.
        if place.master or (config.tracker.rectify and camera.name in place.cameras):
            problems += _lens(config, camera)
    if not place.master:
        return problems
    return problems + _extrinsics(config) + _hands(config) + _objects(config)


def _lens(config: RigConfig, camera: CameraTable) -> list[Problem]:
    path = config.calibration_dir / f"{camera.name}.lens.json"
    # Markers alone need no lens.
    if not config.has_depth and not config.tracker.rectify and not path.exists():
        return []
    problems: list[Problem] = []
    lens = load_or_report(partial(load_lens, config.calibration_dir, camera.name), problems, path)
    if lens is not None and lens.size_px != camera.size_px:
        text = (
            f"was calibrated at {_size(lens.size_px)}, rig.toml has {_size(camera.size_px)} for "
            f"camera {camera.name!r}; set size_px = {list(lens.size_px)}, or run "
            f"`rhot calibrate lens {camera.name}` again"
        )
        problems.append(error(path, text))
    return problems


def _extrinsics(config: RigConfig) -> list[Problem]:
    path = config.calibration_dir / "rig.json"
    if not config.has_depth and not path.exists():
        return []
    problems: list[Problem] = []
    geometry = load_or_report(partial(load_geometry, config.calibration_dir), problems, path)
    if geometry is None:
        return problems
    names = [camera.name for camera in config.camera]
    for name in names:
        if name not in geometry.cameras:
            text = (
                f"camera {name!r} is missing; it has {sorted(geometry.cameras)}. "
                "Run `rhot calibrate stereo` with all cameras"
            )
            problems.append(error(path, text))
    cameras: dict[str, Camera] = {}
    for name in names:
        has_lens = (config.calibration_dir / f"{name}.lens.json").exists()
        if name in geometry.cameras and has_lens:
            load = partial(load_cameras, config.calibration_dir, [name])
            cameras |= load_or_report(load, problems, path) or {}
    for a, b in combinations(cameras.values(), 2):
        baseline_m = float(np.linalg.norm(a.centre_rig - b.centre_rig))
        if baseline_m < _MIN_BASELINE_M:
            text = (
                f"cameras {a.name!r} and {b.name!r} are {1e3 * baseline_m:.1f} mm apart; "
                f"depth needs {1e3 * _MIN_BASELINE_M:.0f} mm or more"
            )
            problems.append(error(path, text))
    return problems


def _hands(config: RigConfig) -> list[Problem]:
    problems: list[Problem] = []
    if not config.has_depth:
        return problems
    for hand, table in config.hand.items():
        path = config.calibration_dir / f"hand.{hand}.json"
        if not path.exists():
            text = (
                f"no such file: the {hand} hand has the bones of an average adult, "
                f"times {table.scale:g} ([hand.{hand}] scale), knuckles 10 to 45 mm off; "
                f"`rhot calibrate hand {hand} --watch` measures it while somebody uses the rig"
            )
            problems.append(note(path, text))
        model = load_or_report(partial(load_hand, config.calibration_dir, hand), problems, path)
        if model is not None:
            problems += [
                error(path, f"says nothing of the paint of landmark {name!r}")
                for name in table.markers
                if name not in model.paint
            ]
    return problems


def _objects(config: RigConfig) -> list[Problem]:
    if not config.object:
        return []
    path = config.calibration_dir / "objects.json"
    problems = check_shapes(config)
    if not path.exists():
        text = (
            "no such file: objects stay in the lighthouse frame until `rhot calibrate objects` has "
            "registered it to the rig"
        )
        return [*problems, warning(path, text)]
    objects = load_or_report(partial(load_objects, config.calibration_dir), problems, path)
    if objects is not None:
        for table in config.object:
            if table.name not in objects.objects:
                text = (
                    f"has no offset for object {table.name!r}: its pose is the tracker's. "
                    "Run `rhot calibrate objects`"
                )
                problems.append(warning(path, text))
            elif table.marker and objects.objects[table.name].marker_m is None:
                text = (
                    f"does not know where the {table.marker} paint is on {table.name}'s tracker: "
                    "drift of the lighthouses is not noticed. Run `rhot calibrate objects "
                    f"{table.name}`"
                )
                problems.append(note(path, text))
        problems += _other_world(config, objects, path)
    return problems


def _other_world(config: RigConfig, objects: Objects, path: Path) -> list[Problem]:
    """A registration that was made while the rig's frame lay elsewhere."""
    world = config.rig.world
    now = None if world is None else [list(row) for row in world.T_rig_from_camera]
    if "T_rig_from_camera" not in objects.inputs or objects.inputs["T_rig_from_camera"] == now:
        return []
    text = (
        "was made with another [rig.world] than rig.toml has now: objects are beside the hands. "
        "Run `rhot calibrate objects`"
    )
    return [error(path, text)]


def _size(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]}"
