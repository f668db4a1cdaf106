"""Where a landmark begins: the motion that both cameras' looks of a moment agree on.

Rays of two cameras at different instants meet centimetres off if the landmark moved in between, so
its place, velocity and acceleration are fitted to all looks of the moment at once, by a Kalman
filter over a fixed state that is linearised anew a few times. The filter starts from that
motion with a wide prior, and takes the looks in again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.geometry.triangulation import TriangulationStatus, triangulate
from services.fusion.kalman.measurement import Innovation, Look, predict_ray
from services.fusion.kalman.model_step import START_SIGMAS

# Rounds of linearisation: the second is within a millimetre, the third within rounding.
_ROUNDS = 3


class Looks(NamedTuple):
    """n looks of one landmark, in order of time."""

    time_s: Array  # (n,)
    camera: Ints  # (n,)
    ray: Array  # (n, 2)
    variance: Array  # (n,) of each ray coordinate
    clock_variance: Array  # (n,) s^2


class Start(NamedTuple):
    """How a landmark began."""

    motion: Array  # (9,) place, velocity, acceleration at the first look
    residual: float  # RMS of the residuals in sigmas, per degree of freedom


def fit_start(
    looks: Looks, cameras: Extrinsics, max_distance_m: float, velocity: Array
) -> Start | None:
    """The motion that looks of two cameras or more agree on; None if their rays do not meet.

    velocity (3,): what others of the hand move by.
    """
    apart_s = np.abs(looks.time_s[:, None] - looks.time_s)  # (n, n)
    apart_s[looks.camera[:, None] == looks.camera] = np.inf
    one, other = np.unravel_index(int(apart_s.argmin()), apart_s.shape)
    if not np.isfinite(apart_s[one, other]):
        return None
    pair = [int(one), int(other)]
    moved = START_SIGMAS[1] * apart_s[one, other] / 0.5
    met = triangulate(
        looks.ray[pair],
        np.sqrt(looks.variance[pair] + moved**2),
        cameras.of(looks.camera[pair]),
        max_distance_m,
    )
    if met.status is not TriangulationStatus.OK:
        return None
    motion = np.concatenate([met.position_m, velocity, np.zeros(3)])
    residual = _fit(looks, cameras, velocity, motion)
    return None if residual < 0.0 else Start(motion, residual)


@njit(cache=True, error_model="numpy")
def _fit(looks: Looks, cameras: Extrinsics, velocity: Array, motion: Array) -> float:
    """Fit a motion (9,), in place; its residual, or -1 if it leads behind a camera."""
    variances = np.repeat(np.array(START_SIGMAS) ** 2, 3)  # (9,)
    at, x, H = np.zeros(10), np.empty(9), np.empty((2, 9))
    out = Innovation(
        np.zeros((2, 3)),
        np.zeros(2),
        np.zeros(2),
        np.zeros((2, 2)),
        np.zeros((2, 10)),
        np.zeros(1),
    )
    chi_squared = 0.0
    for _ in range(_ROUNDS):
        at[:9] = motion
        x[:3], x[3:6], x[6:] = motion[:3], velocity, 0.0
        P, chi_squared = np.diag(variances), 0.0
        for n in range(looks.time_s.size):
            camera, delay_s = looks.camera[n], looks.time_s[n] - looks.time_s[0]
            drift = (START_SIGMAS[1] / 0.5) ** 2 * looks.clock_variance[n]
            variance = looks.variance[n] + drift
            R, t = cameras.R[camera], cameras.t[camera]
            look = Look(0, delay_s, looks.ray[n], variance, R, t)
            # The ray that a filter linearised at x must be given to act as one linearised at
            # `motion`.
            if not predict_ray(at, look, (0.0, 0.0, 0.0), out):
                return -1.0
            H[:, :3], H[:, 3:6], H[:, 6:] = out.H, delay_s * out.H, 0.5 * delay_s**2 * out.H
            nu = out.nu - H @ (x - motion)
            PHt = P @ H.T  # (9, 2)
            S = H @ PHt
            S00, S11, S01 = S[0, 0] + variance, S[1, 1] + variance, S[0, 1]
            inverse = np.array([[S11, -S01], [-S01, S00]]) / (S00 * S11 - S01 * S01)
            K = PHt @ inverse
            x += K @ nu
            P -= K @ PHt.T
            chi_squared += nu @ inverse @ nu
        motion[:] = x
    return float(np.sqrt(chi_squared / max(2 * looks.time_s.size - 3, 1)))
