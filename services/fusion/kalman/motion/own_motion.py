"""What a landmark does by itself beyond its hand's motion: found look by look.

A finger that taps moves by 30 m/s^2 while its hand rests, and no model of the whole hand says so.
So each landmark has jerk of its own, beside the model's: as much as explains its look best, for a
price, if the look is too improbable without. It lasts for some frames, ever less, and as long the
landmark's velocity fades as a lively hand's does. Compiled; nothing here raises.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.kalman.measurement import Innovation, Look
from services.fusion.kalman.motion.motion_models import MotionModels, transition, unit_process_noise

# Squared Mahalanobis distance (2 degrees of freedom) of a look beyond which own motion is looked
# for: 5 % of all by chance.
LOOK_ABOVE = 6.0
# Nats that own motion costs, and how many more for each e-fold of its density above a model's own.
# On the tuning half of points, with an earlier set of models: 2 to 4.5 and .15 to .6 are within 3 %
# of each other (geometric mean of RMS at lags 0 and 2); without own motion taps are 15 mm RMS off
# at lag 0 instead of 2.5.
RARE, DEARER = 3.0, 0.5
# From so small a density (m^2/s^5) by powers of 4 up to MOST: in 16 ms a landmark is then somewhere
# within 7 mm, as far as a tap of 45 m/s^2 takes it. What is farther off is another thing.
LEAST, MOST = 0.1, 3e4
# Own motion fades in so long, s: .03 to .1 are within 3 %. Meanwhile velocity and acceleration fade
# at these rates, 1/s; with (8, 25) errors are 2 % larger. Both with an earlier set of models.
# Below CALM (m^2/s^5) it is over, lest a finger's velocity fades for half a second while its hand
# moves on. Tuning half of points, geometric mean of RMS at lags 0 and 2 over those with .1: with 1
# .992 and .988, with 10 .989 and .987, with 100 .987 and .993, with 1000 .984 and .998.
CALM_S, CALM = 0.045, 10.0
LIVELY = (15.0, 40.0)


class OwnMotion(NamedTuple):
    """A landmark's own jerk that its look asked for."""

    density: float  # m^2/s^5; 0: it explains nothing better
    price: float  # nats


@njit(cache=True, error_model="numpy")
def carried_on(before: float, dt_s: float) -> float:
    """The density dt after it was `before`."""
    density = before * math.exp(-dt_s / CALM_S)
    return density if density > CALM else 0.0


@njit(cache=True, error_model="numpy")
def rates_of(models: MotionModels, m: int, density: float) -> tuple[float, float]:
    """At which velocity and acceleration of a landmark fade in model m, 1/s."""
    a, b = models.velocity_rate[m], models.acceleration_rate[m]
    return (max(a, LIVELY[0]), max(b, LIVELY[1])) if density > 0.0 else (a, b)


@njit(cache=True, error_model="numpy")
def transitions(models: MotionModels, m: int, densities: Array, dt_s: float) -> Array:
    """F over dt of every landmark (N, 6), as transition() has it, by their own jerk (N,)."""
    F = np.empty((densities.shape[0], 6))
    calm = transition(models.velocity_rate[m], models.acceleration_rate[m], dt_s)
    for k in range(densities.shape[0]):
        f = calm
        if densities[k] > 0.0:
            a, b = rates_of(models, m, densities[k])
            f = transition(a, b, dt_s)
        for n in range(6):
            F[k, n] = f[n]
    return F


@njit(cache=True, error_model="numpy")
def own_noise(models: MotionModels, m: int, dt_s: float, Q: Array) -> None:
    """Process noise of one axis over dt for an own density of 1, Q (2, 3, 3) in place.

    First of a landmark that moved with its hand until then, as velocity fades in model m, and then
    of one whose own motion is carried on (transitions). By others' rates, noise of a step is not
    that of its parts, and what the smoother leaves of it may be less than nothing.
    """
    unit_process_noise(rates_of(models, m, 0.0), dt_s, Q[0])
    unit_process_noise(rates_of(models, m, 1.0), dt_s, Q[1])


@njit(cache=True, error_model="numpy")
def add_own(P: Array, k: int, density: float, Q: Array) -> None:
    """Add landmark k's own noise, Q (3, 3) of one axis, to a covariance (D, D)."""
    axes = (P.shape[1] - 1) // 3
    for r in range(3):
        _add_own_row(P, r * axes + 3 * k, 3 * k, density, Q[r])


@njit(cache=True, error_model="numpy")
def add_own_to_places(P: Array, k: int, density: float, Q: Array) -> None:
    """The same to the rows of places (3 N, D)."""
    _add_own_row(P, 3 * k, 3 * k, density, Q[0])


@njit(cache=True, error_model="numpy")
def _add_own_row(P: Array, row: int, column: int, density: float, q: Array) -> None:
    axes = (P.shape[1] - 1) // 3
    for c in range(3):
        for i in range(3):
            P[row + i, c * axes + column + i] += density * q[c]


@njit(cache=True, error_model="numpy")
def own_motion(
    look: Look, innovation: Innovation, determinant: float, Q: Array, usual: float
) -> OwnMotion:
    """How much own motion in the last step explains a look best.

    determinant: of its S; Q (3, 3): one of own_noise; usual: the density that a model has for all.
    """
    nu, H, inverse = innovation.nu, innovation.H, innovation.S_inverse
    n0, n1 = nu[0], nu[1]
    S00, S11 = inverse[1, 1] * determinant, inverse[0, 0] * determinant
    S01 = -inverse[0, 1] * determinant
    h = (1.0, look.delay_s, 0.5 * look.delay_s**2)
    moved = 0.0
    for r in range(3):
        for c in range(3):
            moved += h[r] * Q[r, c] * h[c]
    B00, B01, B11 = 0.0, 0.0, 0.0
    for i in range(3):
        B00 += moved * H[0, i] * H[0, i]
        B01 += moved * H[0, i] * H[1, i]
        B11 += moved * H[1, i] * H[1, i]
    best = math.log(determinant) + innovation.distance[0]
    density, price = 0.0, 0.0
    least = max(usual, LEAST)
    q = 4.0 * least
    while q <= MOST:
        a, b, c2 = S00 + q * B00, S01 + q * B01, S11 + q * B11
        det = a * c2 - b * b
        cost = RARE + DEARER * math.log(q / least)
        value = math.log(det) + (n0 * n0 * c2 - 2.0 * n0 * n1 * b + n1 * n1 * a) / det + 2.0 * cost
        if value < best:
            best, density, price = value, q, cost
        q *= 4.0
    return OwnMotion(density, price)
