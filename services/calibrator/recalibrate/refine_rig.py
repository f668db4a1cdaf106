"""`rhot calibrate refine`: the cameras' places adjusted to markers that moved before them - a
wand's, or a painted hand's. Pure.

The scale comes from a wand, two markers a known length apart; without one the distance of the
second camera from the first is kept. Unknown beside the places (the first camera stays) is by how
much each camera's stamps are late; lenses are not touched. Recordings that cannot tell the places,
and results that are no better on seconds they were not made from, are refused with a
CalibrationError.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, inverse
from services.calibrator.recalibrate.bundle import (
    Problem,
    Solution,
    epipolar,
    fit,
    points_of,
    scatter,
)
from services.calibrator.recalibrate.marker_tracks import Recording

# Points that two cameras locate: 4 s of six markers at 30 fps, 12 s of a wand.
MIN_POINTS = 720
# More points than this gain nothing beside the time they cost: 3000 tell a turn to .004 deg.
_MAX_POINTS = 3000
# Markers must reach over this share of the first camera's picture both ways, and over this ratio of
# distances.
_MIN_SPREAD, _MIN_DEPTH_RATIO = 0.3, 1.15
# Held out, at 640 px width: painted hands leave .2-.4 px, a wrong clock model or swapped markers
# several.
_MAX_PX = 1.5
# Parts of the recording that are fitted and left out by turns, s.
_PART_S = 1.0
# Uncertainty of a turn (deg) and of a shift (share of the cameras' distance) beyond which the old
# places are as good.
_MAX_TURN_DEG, _MAX_SHIFT = 0.3, 0.03


@dataclass(frozen=True)
class Wand:
    """Two colours whose centres are length_m apart, as measured."""

    first: str
    second: str
    length_m: float


@dataclass(frozen=True, eq=False)
class Moved:
    """One camera: turned about its own x, y, z and shifted in the rig frame, each (3,) with sigmas;
    its stamps late by late_ms.
    """

    turned_deg: Array
    turned_sigma_deg: Array
    shifted_mm: Array
    shifted_sigma_mm: Array
    late_ms: float


@dataclass(frozen=True, eq=False)
class Refined:
    """The rig as the markers have it: T_rig_from_camera of all cameras, and what moved.

    Epipolar figures are of seconds that were left out of the fit, px, with the old and the new
    places; wand_mm is the error of the wand's length there, before and after, None without a wand.
    All are wand_fit.scatter.
    """

    cameras: dict[str, Camera]
    moved: dict[str, Moved]
    points: int
    seconds: float
    epipolar_before_px: float
    epipolar_px: float
    wand_mm: tuple[float, float] | None


def refine_rig(
    recorded: Recording, cameras: Mapping[str, Camera], wand: Wand | None = None
) -> Refined:
    """Adjust the places of all cameras but the first to a recording of moving markers.

    Raises CalibrationError, with the reason, if the recording cannot tell the places or the result
    is not to be trusted.
    """
    ends = None if wand is None else _ends(recorded, wand)
    several = max(1, len(recorded.instants_s) * len(recorded.colors) // _MAX_POINTS)
    recorded = replace(recorded, instants_s=recorded.instants_s[::several])
    focals_px = np.array([float(np.mean(camera.focal_px)) for camera in cameras.values()])
    T = np.stack([camera.T_camera_from_rig for camera in cameras.values()])
    problem = Problem(T, focals_px, recorded, ends, wand.length_m if wand else 0.0)
    old = fit(problem, clocks_only=True)
    points = _check_recording(problem, old, list(cameras.values()))
    new = fit(problem)
    before_px, after_px, wand_mm = _held_out(problem)
    _check_result(
        list(cameras),
        new,
        (before_px, after_px),
        wand_mm,
        max(camera.size_px[0] for camera in cameras.values()),
    )
    placed = {
        name: replace(camera, T_rig_from_camera=inverse(new.T[c]))
        for c, (name, camera) in enumerate(cameras.items())
    }
    moved = {name: _moved(new, c) for c, name in enumerate(list(cameras)[1:])}
    return Refined(
        placed, moved, points, float(np.ptp(recorded.instants_s)), before_px, after_px, wand_mm
    )


def _ends(recorded: Recording, wand: Wand) -> tuple[int, int]:
    if (
        not {wand.first, wand.second} <= set(recorded.colors)
        or wand.first == wand.second
        or not 0.02 <= wand.length_m <= 2.0
    ):
        raise CalibrationError(
            f"wand {wand.first},{wand.second}={wand.length_m:g} cannot be used: give two different colours of those recorded "
            f"({', '.join(recorded.colors) or 'none'}) and the distance of their centres in metres, 0.02..2, e.g. blue,green=0.2"
        )
    return recorded.colors.index(wand.first), recorded.colors.index(wand.second)


def _check_recording(problem: Problem, old: Solution, cameras: list[Camera]) -> int:
    """How many points there are, or why they do not do."""
    points, _ = points_of(problem, old)
    points = points[points[:, 2] > 0.0]
    if len(points) < MIN_POINTS:
        raise CalibrationError(
            f"two cameras together followed markers at {len(points)} instants only, {MIN_POINTS} are needed: move the wand or hand before "
            "both for half a minute"
        )
    rays = points[:, :2] / points[:, 2:]
    share = (
        np.ptp(np.quantile(rays, (0.02, 0.98), axis=0), axis=0)
        * problem.focals_px[0]
        / np.array(cameras[0].size_px)
    )
    near, far = np.quantile(points[:, 2], (0.05, 0.95))
    if share.min() < _MIN_SPREAD or far < _MIN_DEPTH_RATIO * near:
        raise CalibrationError(
            f"the markers covered {100 * share[0]:.0f} % of the picture's width, {100 * share[1]:.0f} % of its height and distances of "
            f"{near:.2f} to {far:.2f} m; {100 * _MIN_SPREAD:.0f} % both ways and a ratio of {_MIN_DEPTH_RATIO} are needed: move "
            "everywhere, near and far"
        )
    return len(points)


def _held_out(problem: Problem) -> tuple[float, float, tuple[float, float] | None]:
    """Epipolar RMS px with old and new places, and the wand's errors mm, on every other second,
    fitted to the rest.
    """
    instants_s = problem.recorded.instants_s
    part = np.floor((instants_s - instants_s[0]) / _PART_S).astype(np.int64) % 2
    pixels: tuple[list[Array], list[Array]] = ([], [])
    lengths: tuple[list[Array], list[Array]] = ([], [])
    for mine in (0, 1):
        used, left = (
            replace(problem, recorded=replace(problem.recorded, instants_s=instants_s[part == p]))
            for p in (mine, 1 - mine)
        )
        for k, solution in enumerate((fit(used, clocks_only=True), fit(used))):
            pixels[k].append(epipolar(left, solution))
            lengths[k].append(1e3 * points_of(left, solution)[1])
    before_px, after_px = (scatter(np.concatenate(several)) for several in pixels)
    before_mm, after_mm = (scatter(np.concatenate(several)) for several in lengths)
    return before_px, after_px, None if problem.ends is None else (before_mm, after_mm)


def _check_result(
    names: list[str],
    new: Solution,
    epipolar_px: tuple[float, float],
    wand_mm: tuple[float, float] | None,
    width_px: int,
) -> None:
    before_px, after_px = epipolar_px
    limit_px = _MAX_PX * max(width_px / 640.0, 1.0)
    if not after_px <= limit_px:
        raise CalibrationError(
            f"whatever the places, views differ by {after_px:.1f} px (limit {limit_px:.1f}): are the lenses these cameras' own, the "
            "colours told apart, the clocks steady?"
        )
    for name, sigma in zip(names[1:], new.sigma, strict=True):
        turn_deg = float(np.degrees(sigma[:3].max()))
        distance_m = float(
            np.linalg.norm(inverse(new.T[names.index(name)])[:3, 3] - inverse(new.T[0])[:3, 3])
        )
        share = float(sigma[3:6].max()) / max(distance_m, 1e-6)
        if turn_deg > _MAX_TURN_DEG or share > _MAX_SHIFT:
            raise CalibrationError(
                f"camera {name!r} stays uncertain by {turn_deg:.2f} deg and {1e3 * sigma[3:6].max():.1f} mm; move the markers over the "
                "whole picture, near and far, for longer, or use a wand"
            )
    better = after_px < before_px or (
        wand_mm is not None and wand_mm[1] < wand_mm[0] and after_px < 1.02 * before_px
    )
    if not better:
        raise CalibrationError(
            f"the places as they are explain the recording as well ({before_px:.3f} px, refined {after_px:.3f} px on seconds left out): "
            "nothing to refine"
        )


def _moved(new: Solution, row: int) -> Moved:
    x, sigma = new.x[row], new.sigma[row]
    return Moved(
        np.degrees(x[:3]), np.degrees(sigma[:3]), 1e3 * x[3:6], 1e3 * sigma[3:6], 1e3 * float(x[6])
    )
