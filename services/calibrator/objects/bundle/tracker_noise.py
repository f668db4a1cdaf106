"""Noise of sightings: each camera's own, and the tracker's, which lasts and which all cameras see
alike. Pure.

A residual is r = J dx + H e(s) + n, with n the camera's (variance a sigma_px^2 of each axis), H the
projection and e the tracker's error in space: an Ornstein-Uhlenbeck process with variance b of each
axis and correlation time tau. Lighthouses' errors do last (they come from where the tracker is
seen from), and two cameras see the same e: what they differ by, which is depth, is nearly free of
it. Taking e for white noise of each picture is what spoils depth: 1.6 mm became .5 mm, with 1 mm
that lasts .5 s. a, b and tau are those of greatest likelihood, so nothing of it is assumed.

e at all instants is eliminated through its posterior precision, which is banded (a Markov process:
Rasmussen & Williams, "Gaussian Processes", 2006, appendix B): with W = 1 / (a sigma_px^2),

    L = Q(b, tau) + H^T W H,     V^-1 = W - W H L^-1 H^T W,     |V| = |L| / (|Q| |W|)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize

from rhot.geometry.transforms import Array
from services.calibrator.objects.bundle.reprojection import Reprojection, Scene
from services.calibrator.objects.sightings import Bools

# Instants nearer than this, s, count as so far apart: two cameras may expose together.
_MIN_STEP_S = 1e-4
# Where a, sqrt(b) m and tau s are searched. What a picture's light does to a centroid is no noise
# and lasts as long as the view: markers are never taken for much better than they say.
_CAMERA, _TRACKER_M, _TAU_S = (0.5, 400.0), (2e-5, 0.05), (0.01, 3.0)
_MAX_EVALUATIONS = 80


class Noise(NamedTuple):
    """camera: variance as a multiple of sigma_px^2; tracker_m: one standard deviation of each axis
    of the tracker's error, which lasts tau_s.
    """

    camera: float
    tracker_m: float
    tau_s: float


class Whitened:
    """Sightings (n) of one state with the tracker's error eliminated.

    weight (n,) is what each sighting counts (1; less for what may be an outlier).
    """

    def __init__(self, at: Scene, result: Reprojection, noise: Noise, weight: Array) -> None:
        # In the order of time, tracker by tracker: a process of each its own.
        self._order = np.lexsort((at.stamps_s, at.tracker))
        self._H = result.by_point[self._order]  # (n, 2, 3)
        self._W = (weight / (noise.camera * at.sigma_px**2))[self._order]  # (n,)
        step_s = np.maximum(np.diff(at.stamps_s[self._order]), _MIN_STEP_S)
        step_s = np.where(np.diff(at.tracker[self._order]) != 0, np.inf, step_s)
        keep = np.exp(-step_s / noise.tau_s)
        inverse = 1.0 / -np.expm1(-2.0 * step_s / noise.tau_s)
        n = len(self._W)
        diagonal = np.zeros(n)
        diagonal[0] = 1.0
        diagonal[1:] += inverse
        diagonal[:-1] += keep**2 * inverse
        # At the first instant of each further tracker its process starts anew: keep is 0 there.
        b = noise.tracker_m**2
        banded = np.zeros((4, 3 * n))  # upper form: row 3 the diagonal
        blocks = np.einsum("nki,n,nkj->nij", self._H, self._W, self._H)
        for i in range(3):
            banded[3, i::3] = blocks[:, i, i] + diagonal / b
            for j in range(i):
                banded[3 - (i - j), i::3] = blocks[:, j, i]
        banded[0, 3:] = np.repeat(-keep * inverse / b, 3)
        self._factor = cholesky_banded(banded, check_finite=False)
        self._log_determinant = (
            2.0 * float(np.sum(np.log(self._factor[3])))
            - 3.0 * float(np.sum(np.log(inverse)))
            + 3.0 * n * float(np.log(b))
            - 2.0 * float(np.sum(np.log(self._W)))
        )

    def times(self, columns: Array) -> tuple[Array, Array]:
        """V^-1 columns of (n, 2, k), in their order, and the tracker's error e (n, 3, k) that
        explains them best.
        """
        y = columns[self._order]
        weighted = self._W[:, None, None] * y
        right = np.einsum("nki,nkj->nij", self._H, weighted)  # (n, 3, k)
        error = cho_solve_banded(
            (self._factor, False), right.reshape(3 * len(y), -1), check_finite=False
        ).reshape(right.shape)
        solved = weighted - self._W[:, None, None] * (self._H @ error)
        out, errors = np.empty_like(solved), np.empty_like(error)
        out[self._order], errors[self._order] = solved, error
        return out, errors

    def cost(self, residual_px: Array) -> float:
        """Minus twice the log likelihood of residuals (n, 2), but for a constant."""
        solved, _ = self.times(residual_px[..., None])
        return float(np.sum(solved[..., 0] * residual_px)) + self._log_determinant


def fit_noise(at: Scene, result: Reprojection, inlier: Bools, before: Noise) -> Noise:
    """The noise of greatest likelihood of the residuals that agree."""
    scene, some = at.only(inlier), result.only(inlier)
    ones = np.ones(len(scene.sigma_px))
    low, high = np.log(np.array([_CAMERA, _TRACKER_M, _TAU_S])).T

    def cost(logs: Array) -> float:
        outside = float(np.sum(np.clip(low - logs, 0, None) + np.clip(logs - high, 0, None)))
        noise = Noise(*np.exp(np.clip(logs, low, high)).tolist())
        return Whitened(scene, some, noise, ones).cost(some.residual_px) + 1e3 * outside

    start = np.clip(np.log(np.array(before)), low + 0.1, high - 0.1)
    simplex = start + np.vstack([np.zeros(3), 0.5 * np.eye(3)])
    found = minimize(
        cost,
        start,
        method="Nelder-Mead",
        options={
            "initial_simplex": simplex,
            "maxfev": _MAX_EVALUATIONS,
            "xatol": 0.03,
            "fatol": 0.3,
        },
    )
    return Noise(*np.exp(np.clip(found.x, low, high)).tolist())
