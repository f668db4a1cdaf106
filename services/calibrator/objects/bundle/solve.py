"""The bundle: lighthouse, paint and lateness of trackers from all sightings at once, in pixels.
Pure.

First from afar: Gauss-Newton with Marquardt's damping and Cauchy weights (Triggs et al., "Bundle
Adjustment - A Modern Synthesis", 1999), every sighting by itself. Then generalised least squares
with the noise that the residuals themselves show (tracker_noise.py), Cauchy weights for what is
left of a sighting beside the tracker's own error. Depth needs no weighting: a pixel is a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array, apply
from services.calibrator.objects.bundle.reprojection import (
    POSE_SIZE,
    Reprojection,
    Scene,
    Unknowns,
    reproject,
)
from services.calibrator.objects.bundle.tracker_noise import Noise, Whitened, fit_noise
from services.calibrator.objects.sightings import Bools

# The scene with the trackers' motion for a lateness (K,).
Sampler = Callable[[Array], Scene]

# Times the poses are sampled anew from afar, and steps between; then rounds that learn the noise,
# and steps in each: the last moves nothing by a hundredth of its sigma.
_ROUNDS, _MAX_STEPS = 4, 12
_NOISE_ROUNDS, _NOISE_STEPS = 3, 6
# A step below this share of every sigma changes nothing.
_SETTLED = 0.01
# Cauchy's loss, in standard deviations: 95 % efficient where all is well.
_CAUCHY = 2.4
# Of chi-square with two degrees of freedom: its median, and the limit that 1 % exceed.
_MEDIAN, _LIMIT = 1.386, 9.21
# The noise's start: markers as their sigma says, a tracker's millimetre for a tenth of a second.
_START_NOISE = Noise(1.0, 1e-3, 0.1)
# Residuals of one block, s, count as one where the covariance is judged.
_BLOCK_S = 1.0
# Light from one side moves the middle of what is seen of paint towards it by so much of the paint's
# radius along each axis, for all cameras alike and in all pictures: nothing that is left over shows
# it. (Rendered beads, exact poses, two recordings: .027 RMS of an axis, .033 at most.)
_BY_LIGHT = 0.03
# A marker this far from its tracker's origin is none, m; priors so weak that they only hold what
# no motion shows.
_PRIOR_MARKER_M, _PRIOR_LATE_S = 0.5, 0.5


@dataclass(frozen=True, eq=False)
class Solution:
    """The unknowns with their covariance about the middle (3,) of the motion in the lighthouses'
    frame; what each sighting leaves, and whether it agrees.
    """

    unknowns: Unknowns
    covariance: Array  # (6 + 4 K, 6 + 4 K)
    middle: Array  # (3,)
    scene: Scene
    result: Reprojection
    inlier: Bools  # (n,)
    noise: Noise


def solve(sample: Sampler, start: Unknowns) -> Solution:
    """The registration nearest to a start that is right to some centimetres."""
    unknowns = start
    for _ in range(_ROUNDS):
        at = sample(unknowns.late_s)
        middle = _middle(at, unknowns)
        result = reproject(at, unknowns, middle)
        squared = np.sum(result.residual_px**2, axis=1)
        variance = max(float(np.median(squared)) / _MEDIAN, 1e-6)
        unknowns = _minimise(at, unknowns, middle, variance)
    return refine(sample, unknowns, _START_NOISE, _NOISE_ROUNDS)


def refine(sample: Sampler, start: Unknowns, noise: Noise, rounds: int) -> Solution:
    """Generalised least squares from a start that is right to some millimetres.

    The noise is learnt in each of so many rounds; with none it is taken as given.
    """
    unknowns = start
    for number in range(max(rounds, 1)):
        at = sample(unknowns.late_s)
        middle = _middle(at, unknowns)
        result = reproject(at, unknowns, middle)
        if number < rounds:
            noise = fit_noise(at, result, _screened(result), noise)
        unknowns = _descend(at, unknowns, middle, noise)
    result = reproject(at, unknowns, middle)
    weight, inlier = _weights(at, result, noise)
    covariance = _covariance(at, result, noise, weight)
    covariance[3:POSE_SIZE, 3:POSE_SIZE] += (_BY_LIGHT * _radius_m(at, result)) ** 2 * np.eye(3)
    return Solution(unknowns, covariance, middle, at, result, inlier, noise)


def _middle(at: Scene, unknowns: Unknowns) -> Array:
    """The middle (3,) of the paint's motion in the lighthouses' frame."""
    lever = np.einsum("nij,nj->ni", at.motion.rotation, unknowns.markers_m[at.tracker])
    return np.asarray(np.median(at.motion.position_m + lever, axis=0))


def _minimise(at: Scene, unknowns: Unknowns, middle: Array, variance: float) -> Unknowns:
    prior = _prior(len(unknowns.markers_m))
    damping = 1e-6
    result = reproject(at, unknowns, middle)
    cost = _cost(result, variance)
    for _ in range(_MAX_STEPS):
        squared = np.sum(result.residual_px**2, axis=1) / variance
        weight = 1.0 / (1.0 + squared / _CAUCHY**2) / variance
        J = result.jacobian * weight[:, None, None]
        H = np.einsum("nki,nkj->ij", J, result.jacobian) + np.diag(prior)
        step = _solve(H, np.einsum("nki,nk->i", J, result.residual_px), damping)
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


def _descend(at: Scene, unknowns: Unknowns, middle: Array, noise: Noise) -> Unknowns:
    prior = np.diag(_prior(len(unknowns.markers_m)))
    for _ in range(_NOISE_STEPS):
        result = reproject(at, unknowns, middle)
        weight, _ = _weights(at, result, noise)
        H, gradient = _normal(Whitened(at, result, noise, weight), result)
        step = _solve(H + prior, gradient, 0.0)
        unknowns = unknowns.stepped(step, middle)
        # Every sigma is at least the root of the inverse diagonal.
        if float(np.max(np.abs(step) * np.sqrt(np.diag(H)))) < _SETTLED:
            break
    return unknowns


def _solve(H: Array, gradient: Array, damping: float) -> Array:
    scale = 1.0 / np.sqrt(np.diag(H))
    scaled = H * scale[:, None] * scale + damping * np.eye(len(H))
    return np.asarray(np.linalg.solve(scaled, gradient * scale) * scale)


def _prior(trackers: int) -> Array:
    """What is added to the Hessian's diagonal, (6 + 4 K,): holds steps where motion shows none."""
    own = [_PRIOR_MARKER_M**-2] * 3 + [_PRIOR_LATE_S**-2]
    return np.array([1e-6] * POSE_SIZE + own * trackers)


def _cost(result: Reprojection, variance: float) -> float:
    squared = np.sum(result.residual_px**2, axis=1) / variance
    return float(np.sum(np.log1p(squared / _CAUCHY**2)))


def _screened(result: Reprojection) -> Bools:
    """Which sightings are plainly no outliers, whatever the noise: for the noise's likelihood."""
    squared = np.sum(result.residual_px**2, axis=1)
    return np.asarray(squared <= 2.0 * _LIMIT / _MEDIAN * float(np.median(squared)))


def _weights(at: Scene, result: Reprojection, noise: Noise) -> tuple[Array, Bools]:
    """Cauchy weights (n,) by what the tracker's error does not explain, and who agrees.

    Two rounds: an outlier must not pull the error that it is judged by.
    """
    own = noise.camera * at.sigma_px**2
    tracker = (noise.tracker_m * at.focals_px / result.depth_m) ** 2
    squared = np.sum(result.residual_px**2, axis=1) / (own + tracker)
    weight = 1.0 / (1.0 + (squared / _CAUCHY**2) ** 2)
    for _ in range(2):
        _, error = Whitened(at, result, noise, weight).times(result.residual_px[..., None])
        left = result.residual_px - (result.by_point @ error)[..., 0]
        squared = np.sum(left**2, axis=1) / own
        weight = 1.0 / (1.0 + squared / _CAUCHY**2)
    return weight, squared <= _LIMIT


def _normal(whitened: Whitened, result: Reprojection) -> tuple[Array, Array]:
    """Hessian and gradient of all unknowns."""
    solved, _ = whitened.times(result.jacobian)
    H = np.einsum("nki,nkj->ij", solved, result.jacobian)
    return 0.5 * (H + H.T), np.einsum("nki,nk->i", solved, result.residual_px)


def _covariance(at: Scene, result: Reprojection, noise: Noise, weight: Array) -> Array:
    """Of all unknowns: the inverse Hessian, raised where the gradients of whole blocks of time
    scatter by more than it says.

    That factor is their trace against the Hessian: the sandwich of White (1980) with clusters,
    brought to one number, as few blocks tell no more.
    """
    whitened = Whitened(at, result, noise, weight)
    H, _ = _normal(whitened, result)
    solved, _ = whitened.times(result.jacobian)
    gradients = np.einsum("nki,nk->ni", solved, result.residual_px)
    blocks, number = np.unique(np.floor(at.stamps_s / _BLOCK_S), return_inverse=True)
    summed = np.zeros((len(blocks), len(H)))
    np.add.at(summed, number, gradients)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-30))
    inverse = np.linalg.pinv(H * scale[:, None] * scale, rcond=1e-12, hermitian=True)
    scatter = (summed * scale).T @ (summed * scale)
    freedom = max(1.0 - len(H) / max(len(blocks), 1), 0.25)
    factor = float(np.trace(inverse @ scatter)) / len(H) / freedom
    return np.asarray(inverse * scale[:, None] * scale * max(factor, 1.0))


def _radius_m(at: Scene, result: Reprojection) -> float:
    """Of the paint, by how large it is seen, m: that of a disc which looks as large."""
    return float(np.median(np.sqrt(at.area_px / np.pi) * result.depth_m / at.focals_px))


def middle_of(solution: Solution) -> Array:
    """The middle of the motion in the rig frame; (3,)."""
    return apply(solution.unknowns.T_rig_from_lighthouse, solution.middle)
