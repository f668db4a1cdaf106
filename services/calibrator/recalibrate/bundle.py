"""The bundle adjustment under `rhot calibrate refine`: places of cameras that explain what they saw
of moving markers. Pure.

The points are eliminated: for every trial of the places each marker instant is triangulated, and
what is left in the pictures is minimised (Triggs et al., "Bundle Adjustment - A Modern Synthesis",
1999, section 6), robustly against wrong markers. Whatever the data, something finite comes out: the
old places count as known to PRIOR_*, and a sigma near the prior's says that the data told nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from rhot.geometry.transforms import Array, inverse, rotation_from_vector, transform
from rhot.geometry.triangulation import triangulate
from services.calibrator.bundle.triangulate import epipolar_px
from services.calibrator.recalibrate.marker_tracks import Looks, Recording, looks

# A bumped camera is off by less: three degrees, two centimetres.
PRIOR_RAD, PRIOR_M = 0.05, 0.02
# Clocks are known better than this, or the markers are useless.
PRIOR_LATE_S = 0.02
# Unknowns of each camera but the first: a turn about its own axes (3) rad, a shift in the rig frame
# (3) m, its stamps' lateness s.
SIZE = 7
# Residuals beyond this lose weight, px: painted blobs of a moving hand scatter by .1-.3 px.
_SOFT_PX = 0.5
# Kept distance between the first two cameras: a micrometre counts as a pixel.
_GAUGE_PX_PER_M = 1e6


def _soft_l1(z: Array) -> Array:
    """rho, rho', rho'' (3, n) of squared residuals (n,) as scipy's least_squares wants them."""
    t = 1.0 + z
    return np.stack([2.0 * (np.sqrt(t) - 1.0), t**-0.5, -0.5 * t**-1.5])


def _cauchy(z: Array) -> Array:
    """As `_soft_l1`; far residuals lose their pull altogether."""
    t = 1.0 + z
    return np.stack([np.log(t), 1.0 / t, -1.0 / t**2])


# Rounds of interpolating to the corrected clocks, within which tracks are taken as straight. The
# first must find its way from afar; to the last, a wrong marker's four interpolated looks (1 % of
# wrong markers: 8 % of wrong looks) are as good as absent.
_ROUNDS = (_soft_l1, _cauchy, _cauchy)


@dataclass(frozen=True, eq=False)
class Problem:
    """A recording, the places T_camera_from_rig (C, 4, 4) to begin with, focal lengths (C,), and
    two colours' numbers length_m apart.
    """

    T: Array
    focals_px: Array
    recorded: Recording
    ends: tuple[int, int] | None
    length_m: float


@dataclass(frozen=True, eq=False)
class Solution:
    """The unknowns (C - 1, SIZE) and their sigmas (C - 1, SIZE), 0 where held.

    And the places (C, 4, 4) they make.
    """

    x: Array
    sigma: Array
    T: Array

    @property
    def late_s(self) -> Array:
        """By how much each camera's stamps are late; (C,)."""
        return _late_s(self.x)


def _late_s(x: Array) -> Array:
    return np.concatenate([[0.0], x[:, 6]])


def _moved(T: Array, x: Array) -> Array:
    """T_camera_from_rig (C, 4, 4) moved by x (C - 1, SIZE)."""
    found = [T[0]]
    for old, move in zip(T[1:], x, strict=True):
        T_rig_from_camera = inverse(old)
        R = T_rig_from_camera[:3, :3] @ rotation_from_vector(move[:3])
        found.append(inverse(transform(R, T_rig_from_camera[:3, 3] + move[3:6])))
    return np.stack(found)


def fit(problem: Problem, *, clocks_only: bool = False) -> Solution:
    """The places and clocks that explain the recording best; clocks_only: the places stay."""
    shape = (len(problem.T) - 1, SIZE)
    free = (
        np.tile(np.arange(SIZE) == SIZE - 1, (shape[0], 1))
        if clocks_only
        else np.ones(shape, dtype=bool)
    )
    x, sigma = np.zeros(shape), np.zeros(shape)
    for robust in _ROUNDS:
        start = x.copy()
        given = looks(problem.recorded, _late_s(start))

        def residuals(some: Array, start: Array = start, given: Looks = given) -> Array:
            trial = start.copy()
            trial[free] = some
            return _residuals(problem, given, start, trial)

        def loss(z: Array, robust: Callable[[Array], Array] = robust) -> Array:
            # The last are priors and scale, which no outlier touches.
            n = len(z) - x.size - 1
            return np.concatenate(
                [robust(z[:n]), np.stack([z[n:], np.ones(len(z) - n), np.zeros(len(z) - n)])],
                axis=1,
            )

        found = least_squares(
            residuals,
            x[free],
            x_scale=_scales(shape)[free],
            loss=loss,
            f_scale=_SOFT_PX,
            max_nfev=30,
        )
        x[free] = found.x
        variance = 2.0 * found.cost / max(len(found.fun) - len(found.x), 1)
        sigma[free] = np.sqrt(
            np.maximum(np.diag(np.linalg.pinv(found.jac.T @ found.jac)) * variance, 0.0)
        )
    return Solution(x, sigma, _moved(problem.T, x))


def _scales(shape: tuple[int, ...]) -> Array:
    return np.tile([PRIOR_RAD] * 3 + [PRIOR_M] * 3 + [PRIOR_LATE_S], (shape[0], 1))


@dataclass(frozen=True, eq=False)
class _Located:
    """Rays (C, n, 2) with weights (C, n) px, 0 where none, and the points (n, 3) they meet in.

    N = instants x markers.
    """

    rays: Array
    weights: Array
    points: Array


def _locate(problem: Problem, given: Looks, late_s: Array, T: Array) -> _Located:
    """given was taken with other clocks: late_s (C,) is what is still to be taken off."""
    both = given.seen & (given.seen.sum(axis=0) >= 2)
    rays = (given.rays + given.speeds * late_s[:, None, None, None]).reshape(len(T), -1, 2)
    weights = (both * problem.focals_px[:, None, None]).reshape(len(T), -1)
    points, use = np.zeros((rays.shape[1], 3)), weights.any(axis=0)
    points[use] = triangulate(T, rays[:, use], weights[:, use])
    return _Located(rays, weights, points)


def _residuals(problem: Problem, given: Looks, start: Array, x: Array) -> Array:
    """Pixels left of every look, of the wand's length (px at its distance), of the scale, and of
    the priors; given is of start's clocks.
    """
    T = _moved(problem.T, x)
    located = _locate(problem, given, _late_s(x) - _late_s(start), T)
    p_camera = np.einsum("cij,nj->cni", T[:, :3, :3], located.points) + T[:, None, :3, 3]
    seen = p_camera[..., :2] / np.maximum(p_camera[..., 2:], 1e-3)
    left = ((located.rays - seen) * located.weights[..., None])[located.weights > 0.0].reshape(-1)
    if problem.ends is None:
        lengths, gauge = np.zeros(0), _GAUGE_PX_PER_M * (_distance_m(T) - _distance_m(problem.T))
    else:
        error_m, sigma_m = _lengths(problem, problem.ends, given, T, located)
        lengths, gauge = error_m / sigma_m, 0.0
    return np.concatenate([left, lengths, [gauge], (x / _scales(x.shape)).reshape(-1)])


def _distance_m(T: Array) -> float:
    """Between the first two cameras."""
    return float(np.linalg.norm(inverse(T[1])[:3, 3] - inverse(T[0])[:3, 3]))


def _lengths(
    problem: Problem, ends: tuple[int, int], given: Looks, T: Array, located: _Located
) -> tuple[Array, Array]:
    """Error of the wand's length in m wherever both ends are located, and what a px in one picture
    makes of it.
    """
    several = given.seen.sum(axis=0) >= 2
    at = several[:, ends[0]] & several[:, ends[1]]
    points = located.points.reshape(*several.shape, 3)
    first, second = points[at, ends[0]], points[at, ends[1]]
    along, middle = second - first, 0.5 * (first + second) - inverse(T[0])[:3, 3]
    length, distance = (
        np.maximum(np.linalg.norm(along, axis=1), 1e-6),
        np.maximum(np.linalg.norm(middle, axis=1), 1e-3),
    )
    # What of the wand points away from the cameras is known as depth is, the rest as places in the
    # picture are.
    share = np.abs(np.sum(along * middle, axis=1)) / (length * distance)
    sigma = (
        distance
        / problem.focals_px[0]
        * np.hypot(1.0, share * distance / max(_distance_m(T), 1e-3))
    )
    return length - problem.length_m, sigma


def points_of(problem: Problem, solution: Solution) -> tuple[Array, Array]:
    """All located points (k, 3) in the first camera's frame, and the errors (j,) m of the wand's
    length (none without a wand).
    """
    given = looks(problem.recorded, solution.late_s)
    located = _locate(problem, given, np.zeros(len(problem.T)), solution.T)
    points = (
        located.points[located.weights.any(axis=0)] @ solution.T[0, :3, :3].T + solution.T[0, :3, 3]
    )
    errors = (
        np.zeros(0)
        if problem.ends is None
        else _lengths(problem, problem.ends, given, solution.T, located)[0]
    )
    return points, errors


def epipolar(problem: Problem, solution: Solution) -> Array:
    """Distances (k,) px from the epipolar lines, of the first camera with every other."""
    given, found = looks(problem.recorded, solution.late_s), [np.zeros(0)]
    for c in range(1, len(solution.T)):
        at = given.seen[0] & given.seen[c]
        between = solution.T[c] @ inverse(solution.T[0])
        found.append(
            epipolar_px(between, given.rays[0][at], given.rays[c][at], float(problem.focals_px[c]))
        )
    return np.concatenate(found)


def scatter(values: Array) -> float:
    """RMS of values (n,) as their median size tells it, as if normal about 0: a wrong marker now
    and then does not count. 0 of none.
    """
    return 1.4826 * float(np.median(np.abs(values))) if len(values) else 0.0
