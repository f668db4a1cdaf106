"""How a hand moves, and what measured dots say of it: an extended Kalman filter of its posture.

Postures are those of a body (body/). What moves (place, turn, angles) has a velocity, which fades;
people's lengths do not move. A hand rests or jerks, and so do fingers: each acceleration is one of
a few levels, and fingers close together. Several states are updated at once. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots.body.body import Body
from services.pi_tracker.dots.body.rotations import turned

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

# Velocities fade with this time constant: a hand that turns round is nearer to resting than to
# going on.
_VELOCITY_TIME_S = 0.25
# Sigmas of accelerations, calm and sharper: of the hand's place (m/s^2) and turn (rad/s^2), and of
# its angles (rad/s^2). Chosen on `grab` with seeds 2 and 4 of benchmarks/dots.py, and on tips that
# cross slowly (test_tracker.py), which calm fingers of 25 rad/s^2 let exchange their names.
_HAND, _ANGLES = ((2.0, 15.0), (20.0, 150.0)), (8.0, 50.0, 300.0)
# Log probability of each step to what is sharper.
_SHARP = -1.7
# What was learnt of the person fades, too: it was learnt from a posture that may be wrong. (15 dots
# of `splay`, seeds 2 and 4, with an earlier search: 44 and 77 % right without, 90 and 99 % so;
# .4 s: 93 % of seed 2, but of `grab` with seed 4 42 instead of 46 %.)
_PERSON_TIME_S = 1.0
# A gap longer than this tells nothing of where dots have gone meanwhile.
_LONGEST_GAP_S = 0.5
# Speeds at the start: m/s, rad/s.
_START_M_S, _START_RAD_S = 0.5, 2.0
# What is usual counts in each picture by a share, as pictures that follow each other say the same.
_USUAL_SHARE = 0.1
# Joints yield beyond what they do by so much, rad.
_LIMIT_SIGMA = 0.12
# Linearised anew so often; fingers swing by half a radian from picture to picture.
_ROUNDS = 3


class State(NamedTuple):
    """k states: means (k, d), rotations (k, 3, 3), sides (k,), facing (k, fingers), rad, and
    covariances (k, d, d).

    d is the posture's size and that of what moves: velocities.
    """

    means: Array
    rotations: Array
    sides: Array
    facing: Array
    covs: Array

    def take(self, rows: list[int]) -> State:
        """Some of them."""
        return State(*(part[rows] for part in self))


class Update(NamedTuple):
    """k states with their measurements, and log likelihoods (k,)."""

    state: State
    nats: Array


def between(before_s: float, time_s: float) -> float:
    """The time from a picture to the next, s, as motion counts it."""
    return min(max(time_s - before_s, 1e-3), _LONGEST_GAP_S)


def together(states: list[State]) -> State:
    """All in one."""
    return State(*(np.concatenate(parts) for parts in zip(*states, strict=True)))


def start(
    body: Body, posture: Array, rotation: Array, side: float, facing: Array, cov: Array
) -> State:
    """A hand at a posture (size,) of a covariance, with any velocity; facing (fingers,)."""
    size, count = body.size, body.size + body.moving
    mean, covs = np.zeros((1, count)), np.zeros((1, count, count))
    mean[0, :size] = posture
    covs[0, :size, :size] = cov
    covs[0, size:, size:] = any_speed(body)
    return State(mean, rotation[None], np.array([side]), facing[None], covs)


def any_speed(body: Body) -> Array:
    """The covariance of velocities (moving, moving) of which nothing is known."""
    speeds = np.full(body.moving, _START_RAD_S)
    speeds[:3] = _START_M_S
    return np.diag(speeds**2)


def coasted(body: Body, state: State, elapsed_s: float) -> State:
    """The states after a time without any acceleration."""
    size, moving = body.size, body.moving
    fade = float(np.exp(-elapsed_s / _VELOCITY_TIME_S))
    # How far a velocity that fades carries.
    reach_s = _VELOCITY_TIME_S * (1.0 - fade)
    step = np.eye(size + moving)
    now, speed = np.arange(moving), size + np.arange(moving)
    step[now, speed], step[speed, speed] = reach_s, fade
    person = np.arange(moving, size)
    step[person, person] = stay = float(np.exp(-elapsed_s / _PERSON_TIME_S))
    covs = step @ state.covs @ step.T
    covs[:, person, person] += (1.0 - stay**2) * body.person**2
    return _folded(state._replace(means=state.means @ step.T, covs=covs))


def reversed_in_time(body: Body, state: State) -> State:
    """The states as time that runs backwards has them: what moves goes where it came from."""
    signs = np.ones(body.size + body.moving)
    signs[body.size :] = -1.0
    return state._replace(means=state.means * signs, covs=state.covs * np.outer(signs, signs))


def _accelerated(body: Body, hand: int, angles: int, elapsed_s: float) -> Array:
    """What accelerations of these levels add to a covariance (d, d) in a time."""
    moving, size = body.moving, body.size
    sigmas = np.repeat(_HAND[hand], 3)
    squares = np.zeros((moving, moving))
    squares[:6, :6] = np.diag(sigmas**2)
    squares[6:, 6:] = _ANGLES[angles] ** 2 * body.shares
    cov = np.zeros((size + moving, size + moving))
    # A constant acceleration for the whole time.
    cov[:moving, :moving] = 0.25 * elapsed_s**4 * squares
    cov[:moving, size:] = 0.5 * elapsed_s**3 * squares
    cov[size:, :moving] = cov[:moving, size:].T
    cov[size:, size:] = elapsed_s**2 * squares
    return cov


def levels(body: Body, elapsed_s: float) -> tuple[tuple[Array, float], ...]:
    """What accelerations of the hand and of its fingers add to a covariance (d, d) in a time.

    With the log probability of each; at rest first.
    """
    return tuple(
        (_accelerated(body, hand, angles, elapsed_s), _SHARP * (hand + angles))
        for hand in range(len(_HAND))
        for angles in range(len(_ANGLES))
    )


def updated(body: Body, state: State, seen: Mask, places: Array, variances: Array) -> Update:
    """k states with dots that are `seen` (k, n) at places (k, n, 2) of variances (k, n), px.

    Also with what hands do: usual angles, and joints' ends. The log likelihood is that of the dots'
    places, per px^2 each, times how usual the posture is.
    """
    # What is usual is linear: it is entered once, before dots are linearised again and again.
    state, usual = _usual(body, state)
    (count, dots), size = seen.shape, body.size
    first, total = 2 * dots, 2 * dots + body.angles
    rows = np.zeros((count, total, size))
    spread = np.ones((count, total))
    spread[:, :first] = np.repeat(np.where(seen, variances, 1.0), 2, axis=1)
    offsets = np.zeros((count, total))
    shift, now = np.zeros_like(state.means), _folded(state)
    for _ in range(_ROUNDS):
        pixels, slopes = body.project(*now[:4])
        slopes *= seen[:, :, None, None]
        rows[:, :first] = slopes.reshape(count, first, size)
        offsets[:, :first] = ((places - pixels) * seen[..., None]).reshape(count, first)
        _limit(body, now, rows, offsets, spread)
        residuals = offsets + np.einsum("kms,ks->km", rows, shift[:, :size])
        cross = state.covs[:, :, :size] @ rows.swapaxes(1, 2)
        cov = rows @ cross[:, :size]
        cov[:, np.arange(total), np.arange(total)] += spread
        weighed = np.linalg.solve(cov, residuals[..., None])
        shift = (cross @ weighed)[..., 0]
        now = _folded(state._replace(means=state.means + shift))
    squared = np.einsum("km,km->k", residuals, weighed[..., 0])
    # Dots have a density, postures a weight.
    log_det = np.linalg.slogdet(cov)[1] - np.log(spread[:, first:]).sum(axis=1)
    nats = usual - 0.5 * (squared + log_det) - seen.sum(axis=1) * np.log(2.0 * np.pi)
    covs = state.covs - cross @ np.linalg.solve(cov, cross.swapaxes(1, 2))
    return Update(now._replace(covs=0.5 * (covs + covs.swapaxes(1, 2))), nats)


def _usual(body: Body, state: State) -> tuple[State, Array]:
    """k states with the angles that are usual, and how usual theirs are (k,), nats."""
    rows, spread = body.rows, body.variances / _USUAL_SHARE
    cross = state.covs[:, :, : body.size] @ rows.T  # (k, d, r)
    cov = rows @ cross[:, : body.size] + np.diag(spread)
    residuals = body.targets - state.means[:, : body.size] @ rows.T
    gain = cross @ np.linalg.inv(cov)
    weighed = np.linalg.solve(cov, residuals[..., None])
    squared = np.einsum("kr,kr->k", residuals, weighed[..., 0])
    nats = -0.5 * (squared + np.linalg.slogdet(cov)[1] - np.log(spread).sum())
    means = state.means + (cross @ weighed)[..., 0]
    return state._replace(means=means, covs=state.covs - gain @ cross.swapaxes(1, 2)), nats


def _limit(body: Body, now: State, rows: Array, offsets: Array, spread: Array) -> None:
    """Enter the rows of joints that are beyond their ends; those of the others say nothing."""
    angles = now.means[:, 6 : body.moving]
    inside = np.clip(angles, body.least, body.most)
    beyond, own = inside != angles, np.arange(body.angles)
    first = rows.shape[1] - body.angles
    rows[:, first + own, 6 + own] = beyond
    offsets[:, first:] = inside - angles
    spread[:, first:] = np.where(beyond, _LIMIT_SIGMA**2, 1.0)


def _folded(state: State) -> State:
    """Turns taken into the rotations."""
    means = state.means.copy()
    rotations = turned(means[:, 3:6]) @ state.rotations
    means[:, 3:6] = 0.0
    return state._replace(means=means, rotations=rotations)
