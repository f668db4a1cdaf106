"""Where a landmark begins: the motion that both cameras' looks of a moment agree on.

Rays of two cameras at different instants meet centimetres off if the landmark moved in between, so
its place, velocity and acceleration are fitted to all looks of the moment at once, by a Kalman
filter over a fixed state that is linearised anew a few times. The filter starts from that
motion with a wide prior, and takes the looks in again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
    residual = np.inf
    for _ in range(_ROUNDS):
        fitted = _fit_round(looks, cameras, motion, velocity)
        if fitted is None:
            return None
        motion, residual = fitted
    return Start(motion, residual)


def _fit_round(
    looks: Looks, cameras: Extrinsics, motion: Array, velocity: Array
) -> tuple[Array, float] | None:
    """One round: the motion (9,) fitted with Jacobians at `motion`, and its residual."""
    prior = np.concatenate([motion[:3], velocity, np.zeros(3), [0.0]])  # (10,)
    x, P = prior.copy(), np.diag(np.append(np.repeat(np.square(START_SIGMAS), 3), 0.0))
    at = np.append(motion, 0.0)
    innovation = Innovation(
        np.zeros((2, 3)),
        np.zeros(2),
        np.zeros(2),
        np.zeros((2, 2)),
        np.zeros((2, 10)),
        np.zeros(1),
    )
    chi_squared = 0.0
    for n in range(len(looks.time_s)):
        delay_s = float(looks.time_s[n] - looks.time_s[0])
        camera = int(looks.camera[n])
        drift = float(np.sum(np.square(START_SIGMAS[1] / 0.5))) * float(looks.clock_variance[n])
        look = Look(
            0,
            delay_s,
            looks.ray[n],
            float(looks.variance[n]) + drift,
            cameras.R[camera],
            cameras.t[camera],
        )
        # The ray that a filter linearised at x must be given to act as one linearised at `motion`.
        if not predict_ray(at, look, (0.0, 0.0, 0.0), innovation):
            return None
        by_order = np.array([1.0, delay_s, 0.5 * delay_s**2])
        H = np.concatenate([weight * innovation.H for weight in by_order], axis=1)  # (2, 9)
        S = H @ P[:9, :9] @ H.T + look.ray_variance * np.eye(2)
        nu = innovation.nu - H @ (x - at)[:9]
        K = P[:9, :9] @ H.T @ np.linalg.inv(S)
        x[:9] += K @ nu
        P[:9, :9] -= K @ S @ K.T
        chi_squared += float(nu @ np.linalg.solve(S, nu))
    return x[:9], float(np.sqrt(chi_squared / max(2 * len(looks.time_s) - 3, 1)))
