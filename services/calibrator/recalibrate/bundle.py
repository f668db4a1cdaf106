"""Bundle adjustment of the cameras' extrinsics and stamp delays over marker tracks. Pure.

This is what `rhot calibrate refine` solves. The marker points are eliminated: for every trial of
the extrinsics each marker is triangulated at each instant, and the reprojection errors that remain
are minimised, robustly against wrong markers (Triggs et al., "Bundle Adjustment - A Modern
Synthesis", 1999, section 6). Whatever the data, something finite comes out: the old extrinsics are
a prior (residuals.PRIOR_*), and a sigma near the prior's says that the data determined nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from rhot.geometry.transforms import Array
from services.calibrator.recalibrate.marker_tracks import SampledRays, sample_rays
from services.calibrator.recalibrate.residuals import (
    UNKNOWNS,
    ExtrinsicsProblem,
    prior_sigmas,
    residuals,
    stamp_delays,
    updated_extrinsics,
)

# Residuals beyond this lose weight, px: painted blobs of a moving hand scatter by .1-.3 px.
_ROBUST_PX = 0.5
# Evaluations in each round.
_MAX_EVALUATIONS = 30

Loss = Callable[[Array], Array]


def _soft_l1(z: Array) -> Array:
    """rho, rho', rho'' (3, n) of squared residuals (n,) as scipy's least_squares wants them."""
    t = 1.0 + z
    return np.stack([2.0 * (np.sqrt(t) - 1.0), t**-0.5, -0.5 * t**-1.5])


def _cauchy(z: Array) -> Array:
    """As `_soft_l1`, but far residuals lose nearly all of their influence."""
    t = 1.0 + z
    return np.stack([np.log(t), 1.0 / t, -1.0 / t**2])


# Each round interpolates the tracks to the delays found so far; within a round they are taken as
# straight. The first round must converge from afar; to the last, a wrong marker's four interpolated
# samples (1 % of wrong markers: 8 % of wrong samples) are as good as absent.
_ROUNDS = (_soft_l1, _cauchy, _cauchy)


@dataclass(frozen=True, eq=False)
class ExtrinsicsSolution:
    """The unknowns, their standard deviations (0 where held fixed), and the extrinsics they give.

    An unknown is a row of residuals.UNKNOWNS numbers for each camera but the first.
    """

    x: Array  # (C - 1, UNKNOWNS)
    sigma: Array  # (C - 1, UNKNOWNS)
    T_camera_from_rig: Array  # (C, 4, 4)

    @property
    def stamp_delays_s(self) -> Array:
        """By how much each camera's stamps are late; (C,)."""
        return stamp_delays(self.x)


def solve(problem: ExtrinsicsProblem, *, delays_only: bool = False) -> ExtrinsicsSolution:
    """The extrinsics and delays that explain the tracks best; delays_only keeps the extrinsics."""
    shape = (len(problem.T_camera_from_rig) - 1, UNKNOWNS)
    free = np.ones(shape, dtype=bool)
    if delays_only:
        free[:, : UNKNOWNS - 1] = False
    x, sigma = np.zeros(shape), np.zeros(shape)
    for loss in _ROUNDS:
        sampled = sample_rays(problem.tracks, stamp_delays(x))
        x[free], sigma[free] = _solve_round(problem, sampled, x.copy(), free, loss)
    return ExtrinsicsSolution(x, sigma, updated_extrinsics(problem.T_camera_from_rig, x))


def _solve_round(
    problem: ExtrinsicsProblem, sampled: SampledRays, start: Array, free: Array, loss: Loss
) -> tuple[Array, Array]:
    """The free unknowns and their sigmas; sampled belongs to the clocks of start."""

    def residuals_of(unknowns: Array) -> Array:
        trial = start.copy()
        trial[free] = unknowns
        return residuals(problem, sampled, start, trial)

    def loss_of_data(z: Array) -> Array:
        # The last residuals are scale and priors, which no outlier touches: their loss is linear.
        n = len(z) - start.size - 1
        linear = np.stack([z[n:], np.ones(len(z) - n), np.zeros(len(z) - n)])
        return np.concatenate([loss(z[:n]), linear], axis=1)

    found = least_squares(
        residuals_of,
        start[free],
        x_scale=prior_sigmas(len(problem.T_camera_from_rig))[free],
        loss=loss_of_data,
        f_scale=_ROBUST_PX,
        max_nfev=_MAX_EVALUATIONS,
    )
    variance = 2.0 * found.cost / max(len(found.fun) - len(found.x), 1)
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * variance
    return found.x, np.sqrt(np.maximum(np.diag(covariance), 0.0))
