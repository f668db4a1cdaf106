"""Whether calibration/ holds what a rig.toml needs, and whether the two fit: lenses, places,
colours, exposures, objects.

Every missing or broken file is told with the command that makes it; a hand nobody has measured is a
note, as tables stand in.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import TypeVar

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import (
    ColorRange,
    Objects,
    load_cameras,
    load_colors,
    load_exposure,
    load_geometry,
    load_hand,
    load_lens,
    load_objects,
)
from rhot.files.config import CameraTable, RigConfig
from rhot.geometry.camera import Camera
from services.cli.check.problems import Problem, error, note, warning

T = TypeVar("T")

# Sources that are real cameras, which want a fixed exposure.
_REAL = ("picamera2", "v4l2")
# Depth error grows as 1 / baseline: at 20 mm and 0.6 m, 34 mm per pixel, which no filter mends (9.1
# mm at 75 mm).
_MIN_BASELINE_M = 0.020


def check_calibration(config: RigConfig) -> list[Problem]:
    """Problems of all files under calibration/ that this rig refers to."""
    problems: list[Problem] = []
    for camera in config.camera:
        problems += _colors(config, camera) + _exposure(config, camera) + _lens(config, camera)
    return problems + _places(config) + _hands(config) + _objects(config)


def _colors(config: RigConfig, camera: CameraTable) -> list[Problem]:
    path = config.calibration_dir / f"{camera.name}.colors.json"
    problems: list[Problem] = []
    colors = _tried(lambda: load_colors(config.calibration_dir, camera.name), problems, path)
    if colors is None:
        return problems
    wanted = config.colors or sorted(colors.colors)
    for name in wanted:
        if name not in colors.colors:
            has = ", ".join(sorted(colors.colors)) or "none"
            text = f"colour {name!r} of rig.toml's markers is missing; the file has {has}. Add it with `rhot calibrate colors {camera.name}`"
            problems.append(error(path, text))
    for a, b in combinations([name for name in wanted if name in colors.colors], 2):
        if overlap(colors.colors[a], colors.colors[b]):
            text = f"the ranges of {a!r} and {b!r} overlap: a blob of one may be taken for the other; narrow them with `rhot calibrate colors`"
            problems.append(warning(path, text))
    return problems


def overlap(a: ColorRange, b: ColorRange) -> bool:
    """Whether some HSV value lies in both ranges; hue wraps where low > high."""
    flat = all(max(a.hsv_low[i], b.hsv_low[i]) <= min(a.hsv_high[i], b.hsv_high[i]) for i in (1, 2))
    return flat and any(max(x[0], y[0]) <= min(x[1], y[1]) for x in _hues(a) for y in _hues(b))


def _hues(color: ColorRange) -> list[tuple[int, int]]:
    low, high = color.hsv_low[0], color.hsv_high[0]
    return [(low, high)] if low <= high else [(low, 179), (0, high)]


def _exposure(config: RigConfig, camera: CameraTable) -> list[Problem]:
    path = config.calibration_dir / f"{camera.name}.exposure.json"
    problems: list[Problem] = []
    if path.exists():
        _tried(lambda: load_exposure(config.calibration_dir, camera.name), problems, path)
    elif camera.source.split(":")[0] in _REAL:
        text = f"no such file; colours drift while exposure is automatic. Make it with `rhot calibrate camera {camera.name}`"
        problems.append(warning(path, text))
    return problems


def _lens(config: RigConfig, camera: CameraTable) -> list[Problem]:
    path = config.calibration_dir / f"{camera.name}.lens.json"
    # One camera alone tracks markers, and those need no lens.
    if len(config.camera) < 2 and not path.exists():
        return []
    problems: list[Problem] = []
    lens = _tried(lambda: load_lens(config.calibration_dir, camera.name), problems, path)
    if lens is not None and lens.size_px != camera.size_px:
        text = (
            f"was calibrated at {_size(lens.size_px)}, rig.toml has {_size(camera.size_px)} for camera {camera.name!r}; "
            f"set size_px = {list(lens.size_px)}, or run `rhot calibrate lens {camera.name}` again"
        )
        problems.append(error(path, text))
    return problems


def _places(config: RigConfig) -> list[Problem]:
    if len(config.camera) < 2:
        return []
    path = config.calibration_dir / "rig.json"
    problems: list[Problem] = []
    geometry = _tried(lambda: load_geometry(config.calibration_dir), problems, path)
    if geometry is None:
        return problems
    names = [camera.name for camera in config.camera]
    absent = [name for name in names if name not in geometry.cameras]
    for name in absent:
        text = f"camera {name!r} is missing; it has {sorted(geometry.cameras)}. Run `rhot calibrate stereo` with all cameras"
        problems.append(error(path, text))
    cameras: dict[str, Camera] = {}
    for name in names:
        if name not in absent and (config.calibration_dir / f"{name}.lens.json").exists():
            cameras |= (
                _tried(
                    lambda name=name: load_cameras(config.calibration_dir, [name]), problems, path
                )
                or {}
            )  # type: ignore[misc]
    for a, b in combinations(cameras.values(), 2):
        baseline_m = float(np.linalg.norm(a.centre_rig - b.centre_rig))
        if baseline_m < _MIN_BASELINE_M:
            text = f"cameras {a.name!r} and {b.name!r} are {1e3 * baseline_m:.1f} mm apart; depth needs {1e3 * _MIN_BASELINE_M:.0f} mm or more"
            problems.append(error(path, text))
    return problems


def _hands(config: RigConfig) -> list[Problem]:
    problems: list[Problem] = []
    for hand, table in config.hand.items():
        path = config.calibration_dir / f"hand.{hand}.json"
        if not path.exists():
            text = f"no such file: the {hand} hand has the bones of an average adult, times {table.scale:g} ([hand.{hand}] scale)"
            problems.append(note(path, text))
        model = _tried(lambda hand=hand: load_hand(config.calibration_dir, hand), problems, path)  # type: ignore[misc]
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
    if not path.exists():
        text = "no such file: objects stay in the lighthouse frame until `rhot calibrate objects` has registered it to the rig"
        return [warning(path, text)]
    problems: list[Problem] = []
    objects: Objects | None = _tried(lambda: load_objects(config.calibration_dir), problems, path)
    if objects is not None:
        absent = [table.name for table in config.object if table.name not in objects.objects]
        problems += [
            warning(
                path,
                f"has no offset for object {name!r}: its pose is the tracker's. Run `rhot calibrate objects`",
            )
            for name in absent
        ]
    return problems


def _tried(load: Callable[[], T], problems: list[Problem], path: Path) -> T | None:
    try:
        return load()
    except CalibrationError as broken:
        text = str(broken)
        where = next(
            (name for name in (path, path.parent / "rig.json") if text.startswith(f"{name}: ")),
            path,
        )
        problems.append(error(where, text.removeprefix(f"{where}: ")))
        return None


def _size(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]}"
