"""The bundle: lighthouse, paint and lateness of trackers from all sightings at once, in pixels.
Pure.

Gauss-Newton with Marquardt's damping and Cauchy weights (Triggs et al., "Bundle Adjustment - A
Modern Synthesis", 1999). What a sighting weighs is learnt from the residuals themselves: their
variance is a part of the camera's (sigma_px^2) and a part of the tracker's, a length, which near
the camera is more pixels, a (sigma_px)^2 + b (f / z)^2. Depth needs no weighting of its own: a
pixel is a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from rhot.geometry.transforms import Array, apply
from services.calibrator.objects.reprojection import (
    POSE_SIZE,
    Reprojection,
    Scene,
    Unknowns,
    reproject,
)
from services.calibrator.objects.sightings import Bools

# The scene with the trackers' motion for a lateness (K,).
Sampler = Callable[[Array], Scene]

# Times the poses are sampled anew, and the noise learnt; the last rounds change nothing visible.
_ROUNDS, _MAX_STEPS = 6, 12
# Cauchy's loss, in standard deviations: 95 % efficient where all is well.
_CAUCHY = 2.4
# Of chi-square with two degrees of freedom: its median, the limit that 1 % exceed, and the mean of
# what is below that limit, as a share of two.
_MEDIAN, _LIMIT, _BELOW = 1.386, 9.21, 0.953
# Residuals are alike for as long as a tracker's error lasts, s: those of one block count as one
# where the noise is judged.
_BLOCK_S = 0.5
# A marker this far from its tracker's origin is none, m; priors so weak that they only hold what
# no motion shows.
_PRIOR_MARKER_M, _PRIOR_LATE_S = 0.5, 0.5


@dataclass(frozen=True, eq=False)
class Solution:
    """The unknowns with their covariance about the middle (3,) of the motion in the lighthouses'
    frame; what each sighting leaves, and whether it agrees.

    noise_px scales the cameras' sigma_px, noise_m is the trackers' part across a ray.
    """

    unknowns: Unknowns
    covariance: Array  # (6 + 4 K, 6 + 4 K)
    middle: Array  # (3,)
    scene: Scene
    result: Reprojection
    variance: Array  # (n,), px^2
    noise_px: float
    noise_m: float

    @property
    def inlier(self) -> Bools:
        """Which sightings (n,) agree, at the 1 % limit of their noise."""
        squared = np.sum(self.result.residual_px**2, axis=1)
        return np.asarray(squared <= _LIMIT * self.variance)


def solve(sample: Sampler, start: Unknowns) -> Solution:
    """The registration nearest to a start that is right to some centimetres."""
    unknowns = start
    noise = np.zeros(2)
    for number in range(_ROUNDS):
        at = sample(unknowns.late_s)
        middle = np.median(_lighthouse_points(at, unknowns), axis=0)
        result = reproject(at, unknowns, middle)
        squared = np.sum(result.residual_px**2, axis=1)
        if number == 0:
            variance = np.full(len(squared), max(float(np.median(squared)) / _MEDIAN, 1e-6))
        else:
            noise = _noise(at, result, noise)
            variance = _variance(at, result, noise)
        unknowns = _minimise(at, unknowns, middle, variance)
    result = reproject(at, unknowns, middle)
    variance = _variance(at, result, noise)
    covariance = _covariance(at, result, variance)
    a, b = np.sqrt(noise).tolist()
    return Solution(unknowns, covariance, middle, at, result, variance, a, b)


def _lighthouse_points(at: Scene, unknowns: Unknowns) -> Array:
    lever = np.einsum("nij,nj->ni", at.motion.rotation, unknowns.markers_m[at.tracker])
    return at.motion.position_m + lever


def _minimise(at: Scene, unknowns: Unknowns, middle: Array, variance: Array) -> Unknowns:
    prior = _prior(len(unknowns.markers_m))
    damping = 1e-6
    result = reproject(at, unknowns, middle)
    cost = _cost(result, variance)
    for _ in range(_MAX_STEPS):
        weight = _weight(result, variance)
        H, gradient = _normal(result, weight)
        H = H + np.diag(prior)
        scale = 1.0 / np.sqrt(np.diag(H))
        scaled = H * scale[:, None] * scale + damping * np.eye(len(H))
        step = np.linalg.solve(scaled, gradient * scale) * scale
        trial = unknowns.stepped(step, middle)
        tried = reproject(at, trial, middle)
        tried_cost = _cost(tried, variance)
        if tried_cost > cost:
            damping = max(10.0 * damping, 1e-3)
            continue
        unknowns, result, damping = trial, tried, damping / 10.0
        settled = cost - tried_cost < 1e-6 * cost
        cost = tried_cost
        if settled:
            break
    return unknowns


def _prior(trackers: int) -> Array:
    """What is added to the Hessian's diagonal, (6 + 4 K,): holds steps where motion shows none."""
    own = [_PRIOR_MARKER_M**-2] * 3 + [_PRIOR_LATE_S**-2]
    return np.array([1e-6] * POSE_SIZE + own * trackers)


def _cost(result: Reprojection, variance: Array) -> float:
    squared = np.sum(result.residual_px**2, axis=1) / variance
    return float(np.sum(np.log1p(squared / _CAUCHY**2)))


def _weight(result: Reprojection, variance: Array) -> Array:
    """Of each sighting's square, px^-2."""
    squared = np.sum(result.residual_px**2, axis=1) / variance
    return np.asarray(1.0 / (1.0 + squared / _CAUCHY**2) / variance)


def _normal(result: Reprojection, weight: Array) -> tuple[Array, Array]:
    J = result.jacobian.reshape(-1, result.jacobian.shape[2])
    w = np.repeat(weight, 2)
    weighted = J * w[:, None]
    return weighted.T @ J, weighted.T @ result.residual_px.reshape(-1)


def _noise(at: Scene, result: Reprojection, before: Array) -> Array:
    """Variance components (2,): of the cameras as a multiple of sigma_px^2, of the trackers in m^2.

    Least squares of the squared residuals that are no outliers, each weighed by its own variance.
    """
    parts = np.stack([at.sigma_px**2, (at.focals_px / result.depth_m) ** 2], axis=1)  # (n, 2)
    half = 0.5 * np.sum(result.residual_px**2, axis=1)
    floor = float(np.median(half)) / (0.5 * _MEDIAN)
    found = before
    for _ in range(3):
        variance = parts @ found if found.any() else np.full(len(half), floor)
        variance = np.maximum(variance, 0.05 * floor)
        inner = 2.0 * half <= _LIMIT * variance
        left = parts[inner] / variance[inner, None]
        scale = np.linalg.norm(left, axis=0)
        found = nnls(left / scale, half[inner] / variance[inner] / _BELOW)[0] / scale
    return np.asarray(found)


def _variance(at: Scene, result: Reprojection, noise: Array) -> Array:
    parts = noise[0] * at.sigma_px**2 + noise[1] * (at.focals_px / result.depth_m) ** 2
    return np.maximum(parts, 1e-6)


def _covariance(at: Scene, result: Reprojection, variance: Array) -> Array:
    """Of all unknowns: the inverse Hessian, times by how much less the residuals say than if they
    were independent (a tracker's error lasts).

    That factor is the trace of the blocks' scattered gradients against the Hessian: the sandwich of
    White (1980) with clusters, brought to one number, as few blocks tell no more.
    """
    weight = _weight(result, variance)
    H, _ = _normal(result, weight)
    J, r = result.jacobian, result.residual_px
    gradients = np.einsum("nij,ni->nj", J, r) * weight[:, None]
    block = np.floor(at.stamps_s / _BLOCK_S).astype(np.int64)
    blocks, number = np.unique(block, return_inverse=True)
    summed = np.zeros((len(blocks), H.shape[0]))
    np.add.at(summed, number, gradients)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-30))
    inverse = np.linalg.pinv(H * scale[:, None] * scale, rcond=1e-12, hermitian=True)
    scatter = (summed * scale).T @ (summed * scale)
    freedom = max(1.0 - H.shape[0] / max(len(blocks), 1), 0.25)
    factor = float(np.trace(inverse @ scatter)) / H.shape[0] / freedom
    return np.asarray(inverse * scale[:, None] * scale * max(factor, 1.0))


def points_of(solution: Solution) -> Array:
    """Where the paint was, in the rig frame, at every sighting; (n, 3)."""
    return solution.result.points


def middle_of(solution: Solution) -> Array:
    """The middle of the motion in the rig frame; (3,)."""
    return apply(solution.unknowns.T_rig_from_lighthouse, solution.middle)
