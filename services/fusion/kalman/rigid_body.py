"""A rigid body of markers: one motion for all of them, and each one's place in it. See rest.py for
what it is good for.

For each hand: a Kalman filter of the body's motion (shift and turn about a centre: displacement,
rate, acceleration; motion.py's model), and for each marker its anchor, i.e. its place in the body
as the body is now, with a covariance. Both take the same innovation of every observation. Their
cross-covariance is left out: the full filter was no more exact (offline, the same pictures), and
this one's cost is linear in the markers. Turns are taken to first order: from frame to frame a
resting hand turns by less than .01 rad. Compiled with numba; nothing here raises: what a camera
cannot see gives NOT_VISIBLE and changes nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.kalman.measurement import NOT_VISIBLE, project
from services.fusion.kalman.motion_model import propagate, transition, unit_noise
from services.fusion.method import Ints

# Jerk densities of a resting hand's shift (m^2/s^5) and turn (rad^2/s^5): a sway of millimetres and
# half a degree below 1 Hz. Still depth is up to 11 % worse with ten times as much, and 30 % with a
# tenth.
SHIFT_DENSITY, TURN_DENSITY = 0.003, 0.03
# How a marker wanders in its hand (m^2/s): .3 mm within a second. Fingers that keep still to a
# hundredth of a millimetre are known half again as well with 1e-9, but such that wander by a tenth
# are then off by 1.25 of their sigmas, in a synthetic hand; so by .97.
WANDER = 1e-7
# Sigmas of a new body's rates and accelerations (m/s and rad/s, m/s^2 and rad/s^2): slow, or it
# does not rest.
START_RATE, START_ACCELERATION = (0.02, 0.1), (0.1, 0.5)
# A body is lost beyond these: sigmas of displacement, m and rad (turns are taken to first order),
# and rates, m/s and rad/s.
LOST, FASTEST = (0.03, 0.3), (5.0, 30.0)
_LOG_2PI = math.log(2.0 * math.pi)


class Rest(NamedTuple):
    """H hands, S landmarks; places, shifts and turns are in the rig frame (m, rad, s)."""

    hand: Ints  # (S,) whose the landmark is
    belief: Array  # (S,) that it rests; 0: it has no anchor
    trust: Array  # (S,) belief that has lasted
    seen_s: Array  # (S,)
    anchor: Array  # (S, 3) the place in the body
    anchor_cov: Array  # (S, 3, 3)
    time_s: Array  # (H,) of bodies and anchors; -inf: no look yet
    centre: Array  # (H, 3) the point the body turns about
    motion: Array  # (H, 3, 6): displacement since the anchors were moved, rate, acceleration; of each shift and turn
    cov: Array  # (H, 18, 18)
    trial_s: Array  # (H,) when the latest trial began (rest.py)
    frames: Ints  # (H,) how many were taken in


def empty_rest(hands: list[Ints]) -> Rest:
    """Nothing known of hands whose landmarks have these indices, 0 to S - 1 in all."""
    count, slots = len(hands), sum(map(len, hands))
    hand = np.zeros(slots, dtype=np.int64)
    for number, rows in enumerate(hands):
        hand[rows] = number
    return Rest(
        hand,
        np.zeros(slots),
        np.zeros(slots),
        np.full(slots, -np.inf),
        np.zeros((slots, 3)),
        np.zeros((slots, 3, 3)),
        np.full(count, -np.inf),
        np.zeros((count, 3)),
        np.zeros((count, 3, 6)),
        np.zeros((count, 18, 18)),
        np.full(count, -np.inf),
        np.zeros(count, dtype=np.int64),
    )


@njit(cache=True)
def begin(rest: Rest, hand: int, time_s: float, centre: Array) -> None:
    """A body without motion about a point (3,), and without anchors."""
    rest.trial_s[hand] = time_s
    rest.time_s[hand], rest.centre[hand], rest.motion[hand], rest.cov[hand] = (
        time_s,
        centre,
        0.0,
        0.0,
    )
    for axis in range(6):
        rest.cov[hand, 6 + axis, 6 + axis] = START_RATE[axis // 3] ** 2
        rest.cov[hand, 12 + axis, 12 + axis] = START_ACCELERATION[axis // 3] ** 2
    for slot in range(rest.hand.shape[0]):
        if rest.hand[slot] == hand:
            rest.belief[slot] = rest.trust[slot] = 0.0


@njit(cache=True)
def lost(rest: Rest, hand: int) -> bool:
    """Whether a body's state says nothing any more."""
    sane = 0
    for axis in range(6):
        known = rest.cov[hand, axis, axis] < LOST[axis // 3] ** 2
        sane += known and abs(rest.motion[hand, 1, axis]) < FASTEST[axis // 3]
    return sane < 6


@njit(cache=True)
def moved(rest: Rest, slot: int, later_s: float, place: Array, J: Array) -> None:
    """Place (3,) of a marker so long after its hand's time, and its derivative J (3, 6) by the
    body's shift and turn.
    """
    hand, anchor = rest.hand[slot], rest.anchor[slot]
    x, y, z = (
        anchor[0] - rest.centre[hand, 0],
        anchor[1] - rest.centre[hand, 1],
        anchor[2] - rest.centre[hand, 2],
    )
    J[:] = 0.0
    J[0, 0] = J[1, 1] = J[2, 2] = 1.0
    J[0, 4], J[0, 5], J[1, 3], J[1, 5], J[2, 3], J[2, 4] = z, -y, -z, x, y, -x
    motion = rest.motion[hand]
    for i in range(3):
        place[i] = anchor[i]
        for axis in range(6):
            place[i] += J[i, axis] * (
                motion[0, axis] + later_s * (motion[1, axis] + 0.5 * later_s * motion[2, axis])
            )


@njit(cache=True)
def advance(rest: Rest, hand: int, time_s: float) -> None:
    """Move the body to a later instant, and its anchors with it."""
    dt, motion, J, place, noise, cov = (
        time_s - rest.time_s[hand],
        rest.motion[hand],
        np.empty((3, 6)),
        np.empty(3),
        np.empty((3, 3)),
        np.empty((18, 18)),
    )
    unit_noise(dt, noise)
    propagate(rest.cov[hand], 6, dt, cov)
    for i in range(3):
        for j in range(3):
            for axis in range(6):
                cov[6 * i + axis, 6 * j + axis] += noise[i, j] * (
                    SHIFT_DENSITY if axis < 3 else TURN_DENSITY
                )
    rest.cov[hand] = cov
    f01, f02, f12, f22 = transition(dt)
    for axis in range(6):
        motion[0, axis] += f01 * motion[1, axis] + f02 * motion[2, axis]
        motion[1, axis] += f12 * motion[2, axis]
        motion[2, axis] *= f22
    for slot in range(rest.hand.shape[0]):
        if rest.hand[slot] == hand:
            moved(rest, slot, 0.0, place, J)
            for i in range(3):
                rest.anchor[slot, i] = place[i]
                rest.anchor_cov[slot, i, i] += WANDER * dt
    for i in range(3):
        rest.centre[hand, i] += motion[0, i]
    motion[0], rest.time_s[hand] = 0.0, time_s


@njit(cache=True)
def _correct(mean: Array, cov: Array, PH: Array, Si: Array, nu: Array) -> None:
    """Kalman's update of a mean (n,) and cov (n, n) in place, for P H^T (n, 2), the innovation (2,)
    and its inverse covariance (2, 2).
    """
    gain = np.empty((mean.shape[0], 2))
    for i in range(mean.shape[0]):
        gain[i, 0] = PH[i, 0] * Si[0, 0] + PH[i, 1] * Si[1, 0]
        gain[i, 1] = PH[i, 0] * Si[0, 1] + PH[i, 1] * Si[1, 1]
        mean[i] += gain[i, 0] * nu[0] + gain[i, 1] * nu[1]
    for i in range(mean.shape[0]):
        for j in range(i, mean.shape[0]):
            cov[i, j] -= gain[i, 0] * PH[j, 0] + gain[i, 1] * PH[j, 1]
            cov[j, i] = cov[i, j]


@njit(cache=True)
def look(
    rest: Rest,
    slot: int,
    later_s: float,
    seen: Array,
    variances: Array,
    R: Array,
    t: Array,
    steers: bool,
    gate: float,
) -> float:
    """Take one observation into the anchor and, if it steers, the body; its log-likelihood,
    NOT_VISIBLE behind the camera.

    seen (2,) and variances (2,) as in measure.innovate; the motion's clock error is that of the
    body's rate.
    """
    motion, cov, anchor_cov = (
        rest.motion[rest.hand[slot]],
        rest.cov[rest.hand[slot]],
        rest.anchor_cov[slot],
    )
    J, place, ray, H, HJ = (
        np.empty((3, 6)),
        np.empty(3),
        np.empty(2),
        np.empty((2, 3)),
        np.zeros((2, 6)),
    )
    moved(rest, slot, later_s, place, J)
    if not project(place, R, t, ray, H):
        return NOT_VISIBLE
    drift, PH, DH, S = np.zeros(2), np.zeros((18, 2)), np.zeros((3, 2)), np.zeros((2, 2))
    for k in range(2):
        for axis in range(6):
            HJ[k, axis] = H[k, 0] * J[0, axis] + H[k, 1] * J[1, axis] + H[k, 2] * J[2, axis]
            drift[k] += HJ[k, axis] * motion[1, axis]
    half = 0.5 * later_s * later_s
    for i in range(18):
        for axis in range(6):
            weight = cov[i, axis] + later_s * cov[i, 6 + axis] + half * cov[i, 12 + axis]
            PH[i, 0] += weight * HJ[0, axis]
            PH[i, 1] += weight * HJ[1, axis]
    for i in range(3):
        for k in range(2):
            DH[i, k] = (
                anchor_cov[i, 0] * H[k, 0] + anchor_cov[i, 1] * H[k, 1] + anchor_cov[i, 2] * H[k, 2]
            )
    for k in range(2):
        for n in range(2):
            S[k, n] = (
                variances[1] * drift[k] * drift[n]
                + H[k, 0] * DH[0, n]
                + H[k, 1] * DH[1, n]
                + H[k, 2] * DH[2, n]
            )
            for axis in range(6):
                S[k, n] += HJ[k, axis] * (
                    PH[axis, n] + later_s * PH[6 + axis, n] + half * PH[12 + axis, n]
                )
        S[k, k] += variances[0]
    determinant = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    if not determinant > 0.0:
        return NOT_VISIBLE
    Si, nu = np.array([[S[1, 1], -S[0, 1]], [-S[1, 0], S[0, 0]]]) / determinant, seen - ray
    away = nu[0] * (Si[0, 0] * nu[0] + Si[0, 1] * nu[1]) + nu[1] * (
        Si[1, 0] * nu[0] + Si[1, 1] * nu[1]
    )
    if away <= gate:
        _correct(rest.anchor[slot], anchor_cov, DH, Si, nu)
        if steers:
            _correct(motion.reshape(18), cov, PH, Si, nu)
    return -0.5 * (away + math.log(determinant)) - _LOG_2PI
