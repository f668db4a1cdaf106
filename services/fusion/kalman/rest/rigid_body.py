"""A rigid body of markers: one motion for all of them, and each one's place in it.

For each hand: a Kalman filter of the body's motion (translation and rotation about a centre:
displacement, rate, acceleration, by motion_model.py). For each marker: its anchor, which is its
place in the body as the body is now, with a covariance. body_update.py updates both;
rest_detection.py says what they are good for. Rotations are taken to first order: from frame to
frame a resting hand turns by less than .01 rad. Compiled; nothing here raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.kalman.motion_model import (
    ACCELERATION_TIME_S,
    discretize,
    empty_step,
    propagate_cov,
)

# Jerk densities of a resting hand's translation (m^2/s^5) and rotation (rad^2/s^5): a sway of
# millimetres and half a degree below 1 Hz. Still depth is up to 11 % worse with ten times as much,
# and 30 % with a tenth.
TRANSLATION_DENSITY, ROTATION_DENSITY = 0.003, 0.03
# Its motion at a jerk density of 1.
_UNIT_MODEL = np.array([1.0, 0.0, 1.0 / ACCELERATION_TIME_S])
# Random walk of a marker in its hand (m^2/s): .3 mm within a second. Fingers that keep still to a
# hundredth of a millimetre are known half again as well with 1e-9, but such that wander by a tenth
# are then off by 1.25 of their sigmas, in a synthetic hand; so by .97.
ANCHOR_WALK = 1e-7
# Sigmas of a new body's rates and accelerations (m/s and rad/s, m/s^2 and rad/s^2): slow, or it
# does not rest.
START_RATE, START_ACCELERATION = (0.02, 0.1), (0.1, 0.5)
# A body is lost beyond these: sigmas of displacement, m and rad (rotations are taken to first
# order), and rates, m/s and rad/s.
LOST_SIGMA, LOST_RATE = (0.03, 0.3), (5.0, 30.0)


class RestState(NamedTuple):
    """Bodies of H hands and anchors of L landmarks; all places are in the rig frame (m, rad, s)."""

    hand: Ints  # (L,) whose the landmark is
    probability: Array  # (L,) that it rests; 0: it has no anchor
    sustained: Array  # (L,) probability that has lasted
    observed_s: Array  # (L,) when it was last observed
    anchor: Array  # (L, 3) the place in the body
    anchor_cov: Array  # (L, 3, 3)
    time_s: Array  # (H,) of bodies and anchors; -inf: nothing observed yet
    centre: Array  # (H, 3) the point the body turns about
    # Displacement since the anchors were moved, rate, acceleration; each of translation, rotation.
    motion: Array  # (H, 3, 6)
    cov: Array  # (H, 18, 18) of the motion
    trial_s: Array  # (H,) when the latest trial began (rest_detection.py)
    frames: Ints  # (H,) how many were taken in


def empty_rest(hands: list[Ints]) -> RestState:
    """Nothing known of hands whose landmarks have these indices, 0 to L - 1 in all."""
    count = len(hands)
    landmarks = sum(map(len, hands))
    hand = np.zeros(landmarks, dtype=np.int64)
    for number, members in enumerate(hands):
        hand[members] = number
    return RestState(
        hand=hand,
        probability=np.zeros(landmarks),
        sustained=np.zeros(landmarks),
        observed_s=np.full(landmarks, -np.inf),
        anchor=np.zeros((landmarks, 3)),
        anchor_cov=np.zeros((landmarks, 3, 3)),
        time_s=np.full(count, -np.inf),
        centre=np.zeros((count, 3)),
        motion=np.zeros((count, 3, 6)),
        cov=np.zeros((count, 18, 18)),
        trial_s=np.full(count, -np.inf),
        frames=np.zeros(count, dtype=np.int64),
    )


@njit(cache=True, error_model="numpy")
def start_body(rest: RestState, hand: int, time_s: float, centre: Array) -> None:
    """A body without motion about a point (3,), and without anchors."""
    rest.trial_s[hand] = time_s
    rest.time_s[hand] = time_s
    rest.centre[hand] = centre
    rest.motion[hand] = 0.0
    rest.cov[hand] = 0.0
    for axis in range(6):
        rest.cov[hand, 6 + axis, 6 + axis] = START_RATE[axis // 3] ** 2
        rest.cov[hand, 12 + axis, 12 + axis] = START_ACCELERATION[axis // 3] ** 2
    for landmark in range(rest.hand.shape[0]):
        if rest.hand[landmark] == hand:
            rest.probability[landmark] = 0.0
            rest.sustained[landmark] = 0.0


@njit(cache=True, error_model="numpy")
def is_lost(rest: RestState, hand: int) -> bool:
    """Whether a body's state says nothing any more; so does one that is not finite."""
    sane = 0
    for axis in range(6):
        known = rest.cov[hand, axis, axis] < LOST_SIGMA[axis // 3] ** 2
        sane += known and abs(rest.motion[hand, 1, axis]) < LOST_RATE[axis // 3]
    return sane < 6


@njit(cache=True, error_model="numpy")
def place_in_body(rest: RestState, landmark: int, dt_s: float, place: Array, J: Array) -> None:
    """Place (3,) of a marker dt_s after its hand's time; written in place, as is J.

    J (3, 6) is its Jacobian by the body's translation and rotation.
    """
    hand = rest.hand[landmark]
    anchor = rest.anchor[landmark]
    motion = rest.motion[hand]
    x = anchor[0] - rest.centre[hand, 0]
    y = anchor[1] - rest.centre[hand, 1]
    z = anchor[2] - rest.centre[hand, 2]
    # Translation: the identity. Rotation: its cross product with (x, y, z).
    J[:] = 0.0
    J[0, 0] = J[1, 1] = J[2, 2] = 1.0
    J[0, 4], J[0, 5] = z, -y
    J[1, 3], J[1, 5] = -z, x
    J[2, 3], J[2, 4] = y, -x
    for i in range(3):
        place[i] = anchor[i]
        for axis in range(6):
            place[i] += J[i, axis] * (
                motion[0, axis] + dt_s * (motion[1, axis] + 0.5 * dt_s * motion[2, axis])
            )


@njit(cache=True, error_model="numpy")
def advance_body(rest: RestState, hand: int, time_s: float) -> None:
    """Predict the body to a later instant, and move its anchors with it."""
    dt_s = time_s - rest.time_s[hand]
    motion = rest.motion[hand]
    _predict_body(motion, rest.cov[hand], dt_s)
    place = np.empty(3)
    J = np.empty((3, 6))
    for landmark in range(rest.hand.shape[0]):
        if rest.hand[landmark] == hand:
            place_in_body(rest, landmark, 0.0, place, J)
            for i in range(3):
                rest.anchor[landmark, i] = place[i]
                rest.anchor_cov[landmark, i, i] += ANCHOR_WALK * dt_s
    for i in range(3):
        rest.centre[hand, i] += motion[0, i]
    motion[0] = 0.0
    rest.time_s[hand] = time_s


@njit(cache=True, error_model="numpy")
def _predict_body(motion: Array, cov: Array, dt_s: float) -> None:
    """Motion (3, 6) and its covariance (18, 18) dt_s later, in place: F x, F P F^T + Q."""
    step = empty_step()
    discretize(dt_s, _UNIT_MODEL, step)
    F, Q = step.F, step.Q
    predicted_cov = np.empty((18, 18))
    propagate_cov(cov, 6, F, predicted_cov)
    for i in range(3):
        for j in range(3):
            for axis in range(6):
                density = TRANSLATION_DENSITY if axis < 3 else ROTATION_DENSITY
                predicted_cov[6 * i + axis, 6 * j + axis] += Q[i, j] * density
    cov[:] = predicted_cov
    for axis in range(6):
        p, v, a = motion[0, axis], motion[1, axis], motion[2, axis]
        motion[0, axis] = p + F[0, 1] * v + F[0, 2] * a
        motion[1, axis] = F[1, 1] * v + F[1, 2] * a
        motion[2, axis] = F[2, 1] * v + F[2, 2] * a
