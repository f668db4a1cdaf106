"""Residuals of a trial of the extrinsics: reprojection, wand length, scale and priors. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array, inverse, rotation_from_vector, transform
from rhot.geometry.triangulation import triangulate
from services.calibrator.recalibrate.marker_tracks import MarkerTracks, SampledRays

# A bumped camera is off by less: three degrees, two centimetres.
PRIOR_RAD, PRIOR_M = 0.05, 0.02
# Clocks are known better than this, or the markers are useless.
PRIOR_DELAY_S = 0.02
# Unknowns of each camera but the first: a rotation about its own axes (3) rad, a shift in the rig
# frame (3) m, the delay of its stamps s.
UNKNOWNS = 7
# Holds the distance between the first two cameras: a micrometre counts as a pixel.
_SCALE_PX_PER_M = 1e6


class WandEnds(NamedTuple):
    """The wand's two markers as columns of the tracks' colours, length_m apart."""

    first: int
    second: int
    length_m: float


@dataclass(frozen=True, eq=False)
class ExtrinsicsProblem:
    """Marker tracks, and the cameras as they were calibrated; wand is None if there is none."""

    T_camera_from_rig: Array  # (C, 4, 4)
    focals_px: Array  # (C,)
    tracks: MarkerTracks
    wand: WandEnds | None


@dataclass(frozen=True, eq=False)
class TriangulatedMarkers:
    """Points where rays of two cameras or more meet; n = instants x markers."""

    rays: Array  # (C, n, 2)
    weights: Array  # (C, n) px, 0 where there is no ray
    points: Array  # (n, 3)


def updated_extrinsics(T_camera_from_rig: Array, x: Array) -> Array:
    """T_camera_from_rig (C, 4, 4) after the update x (C - 1, UNKNOWNS)."""
    found = [T_camera_from_rig[0]]
    for old, update in zip(T_camera_from_rig[1:], x, strict=True):
        T_rig_from_camera = inverse(old)
        R = T_rig_from_camera[:3, :3] @ rotation_from_vector(update[:3])
        found.append(inverse(transform(R, T_rig_from_camera[:3, 3] + update[3:6])))
    return np.stack(found)


def stamp_delays(x: Array) -> Array:
    """By how much each camera's stamps are late, s; (C - 1, UNKNOWNS) -> (C,)."""
    return np.concatenate([[0.0], x[:, 6]])


def prior_sigmas(cameras: int) -> Array:
    """Standard deviations of the unknowns before any data; (cameras - 1, UNKNOWNS)."""
    return np.tile([PRIOR_RAD] * 3 + [PRIOR_M] * 3 + [PRIOR_DELAY_S], (cameras - 1, 1))


def triangulate_markers(
    problem: ExtrinsicsProblem, sampled: SampledRays, more_delay_s: Array, T_camera_from_rig: Array
) -> TriangulatedMarkers:
    """Points of all markers at all instants.

    sampled may belong to other clocks: more_delay_s (C,) is the delay that is still to be removed.
    """
    cameras = len(T_camera_from_rig)
    usable = sampled.seen & (sampled.seen.sum(axis=0) >= 2)
    rays = sampled.rays + sampled.ray_rates * more_delay_s[:, None, None, None]
    rays = rays.reshape(cameras, -1, 2)
    weights = (usable * problem.focals_px[:, None, None]).reshape(cameras, -1)
    points, use = np.zeros((rays.shape[1], 3)), weights.any(axis=0)
    points[use] = triangulate(T_camera_from_rig, rays[:, use], weights[:, use])
    return TriangulatedMarkers(rays, weights, points)


def residuals(problem: ExtrinsicsProblem, sampled: SampledRays, start: Array, x: Array) -> Array:
    """Reprojection errors, errors of the wand's length (both px), the scale's, and the priors'.

    sampled belongs to the clocks of start (C - 1, UNKNOWNS); x is the trial, of the same shape. The
    last 1 + x.size residuals are those of scale and priors.
    """
    T = updated_extrinsics(problem.T_camera_from_rig, x)
    located = triangulate_markers(problem, sampled, stamp_delays(x) - stamp_delays(start), T)
    p_camera = np.einsum("cij,nj->cni", T[:, :3, :3], located.points) + T[:, None, :3, 3]
    projected = p_camera[..., :2] / np.maximum(p_camera[..., 2:], 1e-3)
    errors = (located.rays - projected) * located.weights[..., None]
    reprojection = errors[located.weights > 0.0].reshape(-1)
    if problem.wand is None:
        lengths = np.zeros(0)
        change_m = _baseline_m(T) - _baseline_m(problem.T_camera_from_rig)
        scale = _SCALE_PX_PER_M * change_m
    else:
        error_m, sigma_m = wand_errors(problem, problem.wand, sampled, T, located)
        lengths = error_m / sigma_m
        scale = 0.0
    priors = (x / prior_sigmas(len(T))).reshape(-1)
    return np.concatenate([reprojection, lengths, [scale], priors])


def wand_errors(
    problem: ExtrinsicsProblem,
    wand: WandEnds,
    sampled: SampledRays,
    T_camera_from_rig: Array,
    located: TriangulatedMarkers,
) -> tuple[Array, Array]:
    """Errors (j,) m of the wand's length wherever both ends are located, and sigmas (j,) m.

    A sigma is what one pixel in one picture makes of the length.
    """
    several = sampled.seen.sum(axis=0) >= 2
    at = several[:, wand.first] & several[:, wand.second]
    points = located.points.reshape(*several.shape, 3)
    first, second = points[at, wand.first], points[at, wand.second]
    along = second - first
    middle = 0.5 * (first + second) - inverse(T_camera_from_rig[0])[:3, 3]
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-6)
    distance = np.maximum(np.linalg.norm(middle, axis=1), 1e-3)
    # The part of the wand that points away from the cameras is as uncertain as depth is, the rest
    # as positions in the picture are.
    depth_share = np.abs(np.sum(along * middle, axis=1)) / (length * distance)
    depth_factor = depth_share * distance / max(_baseline_m(T_camera_from_rig), 1e-3)
    sigma = distance / problem.focals_px[0] * np.hypot(1.0, depth_factor)
    return length - wand.length_m, sigma


def _baseline_m(T_camera_from_rig: Array) -> float:
    """Distance of the first two cameras."""
    first, second = (inverse(T)[:3, 3] for T in T_camera_from_rig[:2])
    return float(np.linalg.norm(second - first))
