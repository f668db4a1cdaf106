"""Errors of the old and the refined extrinsics on seconds that were left out of the fit. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rhot.geometry.transforms import Array, inverse
from services.calibrator.bundle.rigid_fit import epipolar_px
from services.calibrator.recalibrate.bundle import ExtrinsicsSolution, solve
from services.calibrator.recalibrate.marker_tracks import sample_rays
from services.calibrator.recalibrate.residuals import (
    ExtrinsicsProblem,
    triangulate_markers,
    wand_errors,
)

# Parts of the recording that are fitted and held out by turns, s.
_PART_S = 1.0
# Ratio of the standard deviation to the median absolute value, of a normal distribution about 0.
_SIGMA_FROM_MEDIAN = 1.4826


@dataclass(frozen=True)
class HeldOutErrors:
    """Robust RMS before and after refinement, as (before, after).

    Distance from the epipolar lines, and error of the wand's length (None without a wand).
    """

    epipolar_px: tuple[float, float]
    wand_mm: tuple[float, float] | None


def held_out_errors(problem: ExtrinsicsProblem) -> HeldOutErrors:
    """Both errors on every other second, each time with the fit to the seconds between."""
    instants_s = problem.tracks.instants_s
    part = np.floor((instants_s - instants_s[0]) / _PART_S).astype(np.int64) % 2
    epipolar: tuple[list[Array], list[Array]] = ([], [])
    wand: tuple[list[Array], list[Array]] = ([], [])
    for fitted_part in (0, 1):
        fitted, left_out = (
            replace(problem, tracks=replace(problem.tracks, instants_s=instants_s[part == p]))
            for p in (fitted_part, 1 - fitted_part)
        )
        for k, solution in enumerate((solve(fitted, delays_only=True), solve(fitted))):
            epipolar[k].append(_epipolar_distances(left_out, solution))
            wand[k].append(1e3 * locate_markers(left_out, solution)[1])
    before_px, after_px = (_robust_rms(np.concatenate(parts)) for parts in epipolar)
    before_mm, after_mm = (_robust_rms(np.concatenate(parts)) for parts in wand)
    with_wand = problem.wand is not None
    return HeldOutErrors((before_px, after_px), (before_mm, after_mm) if with_wand else None)


def locate_markers(problem: ExtrinsicsProblem, solution: ExtrinsicsSolution) -> tuple[Array, Array]:
    """All located points (k, 3) in the first camera's frame, and the errors (j,) m of the wand's
    length (none without a wand).
    """
    T = solution.T_camera_from_rig
    sampled = sample_rays(problem.tracks, solution.stamp_delays_s)
    located = triangulate_markers(problem, sampled, np.zeros(len(T)), T)
    points = located.points[located.weights.any(axis=0)] @ T[0, :3, :3].T + T[0, :3, 3]
    if problem.wand is None:
        return points, np.zeros(0)
    return points, wand_errors(problem, problem.wand, sampled, T, located)[0]


def _epipolar_distances(problem: ExtrinsicsProblem, solution: ExtrinsicsSolution) -> Array:
    """Distances (k,) px from the epipolar lines, of the first camera with every other."""
    T = solution.T_camera_from_rig
    sampled = sample_rays(problem.tracks, solution.stamp_delays_s)
    found = [np.zeros(0)]
    for c in range(1, len(T)):
        both = sampled.seen[0] & sampled.seen[c]
        rays_first, rays_second = sampled.rays[0][both], sampled.rays[c][both]
        T_second_from_first = T[c] @ inverse(T[0])
        focal_px = float(problem.focals_px[c])
        found.append(epipolar_px(T_second_from_first, rays_first, rays_second, focal_px))
    return np.concatenate(found)


def _robust_rms(values: Array) -> float:
    """RMS of values (n,) from their median size, as if normal about 0; 0 if there are none.

    A wrong marker now and then does not count.
    """
    return _SIGMA_FROM_MEDIAN * float(np.median(np.abs(values))) if len(values) else 0.0
