"""The recent observations of every landmark in order of time, filtered forward, and smoothed back
to any instant.

Each landmark keeps the last NODES observations with the estimate after each. An observation that
arrives late is put in its place and the later ones are filtered again; one older than the whole
ring is refused. Several motion models run side by side, which differ in how lively they take the
landmark to be (multiple-model adaptive estimation: Magill, IEEE TAC 10(4), 1965); their likelihoods
weigh them, so that a resting hand is averaged and a fast one is followed, and the covariance is
right for both. Compiled with numba; the arrays live in a Ring, which kalman.py owns. Nothing here
raises; codes tell what happened.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.kalman.measurement import (
    NOT_VISIBLE,
    correct,
    distance_squared,
    innovate,
    retract,
)
from services.fusion.kalman.motion_model import predict, retreat, unit_noise
from services.fusion.method import Ints

# 32 observations are .53 s of two cameras at 30 fps and 90 ms of four at 90 fps: room for two
# frames of lag and for latency.
NODES = 32
ACCEPTED, GATED, LATE, UNSEEN = 0, 1, 2, 3
# Share of belief that leaks to the other models at each observation; keeps every model ready to
# take over within an observation or two.
_LEAK = 0.003
# Sizes (prior included) at which a track begins again from a better guess: once four, then seven
# observations tell where it was. Without it, the second and third point of new tracks were off by
# 3.9 and 1.6 sigmas (one frame of lag), with it by 2.6 and 1.3.
_YOUNG = (4, 6)


class Ring(NamedTuple):
    """S landmarks, NODES observations, M models. `order` lists a landmark's storage rows by time.

    Node 0 of a new track is its prior.
    """

    filled: Ints  # (S,) how many nodes each landmark has
    order: Ints  # (S, NODES)
    time_s: Array  # (S, NODES)
    camera: Ints  # (S, NODES), -1: the prior
    seen: Array  # (S, NODES, 2)
    variance: Array  # (S, NODES, 2): of the ray, of the clock
    belief: Array  # (S, NODES, M)
    state: Array  # (S, NODES, M, 9)
    cov: Array  # (S, NODES, M, 9, 9)
    H: Array  # (S, NODES, M, 2, 3)
    nu: Array  # (S, NODES, M, 2)
    Si: Array  # (S, NODES, M, 2, 2)
    gain: Array  # (S, NODES, M, 9, 2)
    evidence: Array  # (S,) log-likelihood of the observation taken in last, by all models as they were believed


def empty_ring(slots: int, models: int) -> Ring:
    """A ring of `slots` landmarks without tracks."""
    shape = (slots, NODES)
    return Ring(
        np.zeros(slots, dtype=np.int64),
        np.tile(np.arange(NODES), (slots, 1)),
        np.zeros(shape),
        np.full(shape, -1),
        np.zeros((*shape, 2)),
        np.zeros((*shape, 2)),
        np.zeros((*shape, models)),
        np.zeros((*shape, models, 9)),
        np.zeros((*shape, models, 9, 9)),
        np.zeros((*shape, models, 2, 3)),
        np.zeros((*shape, models, 2)),
        np.zeros((*shape, models, 2, 2)),
        np.zeros((*shape, models, 9, 2)),
        np.zeros(slots),
    )


@njit(cache=True)
def start(ring: Ring, slot: int, time_s: float, p_rig: Array, sigmas: Array) -> None:
    """Begin a track at a point (3,) with the prior's sigmas of position, velocity and acceleration
    (3,); older nodes are forgotten.
    """
    node = ring.order[slot, 0]
    ring.filled[slot], ring.time_s[slot, node], ring.camera[slot, node] = 1, time_s, -1
    models = ring.belief.shape[2]
    # The liveliest model first: with equal shares, the second point of new tracks was off by 2.6 of
    # its sigmas, so by 2.1.
    ring.belief[slot, node] = 0.01
    ring.belief[slot, node, models - 1] = 1.0 - 0.01 * (models - 1)
    ring.state[slot, node], ring.cov[slot, node] = 0.0, 0.0
    for m in range(models):
        for i in range(3):
            ring.state[slot, node, m, i] = p_rig[i]
            for k in range(3):
                ring.cov[slot, node, m, 3 * k + i, 3 * k + i] = sigmas[k] ** 2


@njit(cache=True)
def _place(ring: Ring, slot: int, time_s: float) -> int:
    """How many nodes are not later than time_s."""
    place = ring.filled[slot]
    while place > 0 and ring.time_s[slot, ring.order[slot, place - 1]] > time_s:
        place -= 1
    return place


@njit(cache=True)
def _filter(
    ring: Ring, slot: int, place: int, R: Array, t: Array, densities: Array, noise: Array
) -> tuple[float, float]:
    """Estimate after node `place` from the node before it: smallest normalised innovation squared
    of all models, and log-likelihood.

    R (C, 3, 3) and t (C, 3) are every camera's T_camera_from_rig. Infinite when no model has the
    landmark in front of the camera.
    """
    last, node = ring.order[slot, place - 1], ring.order[slot, place]
    dt = ring.time_s[slot, node] - ring.time_s[slot, last]
    unit_noise(dt, noise)
    camera, models = ring.camera[slot, node], densities.shape[0]
    nearest, best = np.inf, NOT_VISIBLE
    for m in range(models):
        state, cov, gain = (
            ring.state[slot, node, m],
            ring.cov[slot, node, m],
            ring.gain[slot, node, m],
        )
        H, nu, Si = ring.H[slot, node, m], ring.nu[slot, node, m], ring.Si[slot, node, m]
        predict(
            ring.state[slot, last, m], ring.cov[slot, last, m], dt, densities[m], noise, state, cov
        )
        likelihood = innovate(
            state,
            cov,
            R[camera],
            t[camera],
            ring.seen[slot, node],
            ring.variance[slot, node],
            H,
            nu,
            Si,
            gain,
        )
        ring.belief[slot, node, m] = likelihood
        if likelihood > NOT_VISIBLE:
            best, nearest = max(best, likelihood), min(nearest, distance_squared(nu, Si))
            correct(state, cov, H, nu, gain)
        else:
            H[:], nu[:], Si[:], gain[:] = 0.0, 0.0, 0.0, 0.0
    total = 0.0
    for m in range(models):
        prior = (1.0 - _LEAK) * ring.belief[slot, last, m] + _LEAK / models
        ring.belief[slot, node, m] = prior * math.exp(
            max(ring.belief[slot, node, m] - best, -700.0)
        )
        total += ring.belief[slot, node, m]
    ring.belief[slot, node] /= total
    return nearest, best + math.log(total)


@njit(cache=True)
def _smooth(
    ring: Ring, slot: int, place: int, m: int, time_s: float, state: Array, cov: Array
) -> None:
    """Take the observations from `place` on, all later than time_s, into a prediction (9,), (9, 9)
    to time_s of model m, in place.
    """
    adjoint, curvature, product = np.zeros(9), np.zeros((9, 9)), np.zeros((9, 9))
    for k in range(ring.filled[slot] - 1, place - 1, -1):
        node = ring.order[slot, k]
        retract(
            adjoint,
            curvature,
            ring.H[slot, node, m],
            ring.nu[slot, node, m],
            ring.Si[slot, node, m],
            ring.gain[slot, node, m],
        )
        before = time_s if k == place else ring.time_s[slot, ring.order[slot, k - 1]]
        retreat(adjoint, curvature, ring.time_s[slot, node] - before)
    for i in range(9):
        for j in range(9):
            state[i] -= cov[i, j] * adjoint[j]
            for k in range(9):
                product[i, j] += cov[i, k] * curvature[k, j]
    correction = np.zeros((9, 9))
    for i in range(9):
        for j in range(9):
            for k in range(9):
                correction[i, j] += product[i, k] * cov[k, j]
    for i in range(9):
        for j in range(9):
            cov[i, j] -= 0.5 * (correction[i, j] + correction[j, i])


@njit(cache=True)
def query(ring: Ring, slot: int, time_s: float, densities: Array, mean: Array, cov: Array) -> bool:
    """Position and velocity at an instant from all observations, before and after it: mean (6,),
    cov (6, 6), written in place.

    False if the track does not reach back that far, or there is none.
    """
    place, count = _place(ring, slot, time_s), ring.filled[slot]
    if place == 0:
        return False
    last, newest = ring.order[slot, place - 1], ring.order[slot, count - 1]
    dt, models = time_s - ring.time_s[slot, last], densities.shape[0]
    states, covs, noise = np.empty((models, 9)), np.empty((models, 9, 9)), np.empty((3, 3))
    unit_noise(dt, noise)
    mean[:], cov[:] = 0.0, 0.0
    for m in range(models):
        predict(
            ring.state[slot, last, m],
            ring.cov[slot, last, m],
            dt,
            densities[m],
            noise,
            states[m],
            covs[m],
        )
        if place < count:
            _smooth(ring, slot, place, m, time_s, states[m], covs[m])
        mean += ring.belief[slot, newest, m] * states[m, :6]
    for m in range(models):
        for i in range(6):
            for j in range(6):
                spread = (states[m, i] - mean[i]) * (states[m, j] - mean[j])
                cov[i, j] += ring.belief[slot, newest, m] * (covs[m, i, j] + spread)
    return True


@njit(cache=True)
def _begin_again(ring: Ring, slot: int, R: Array, t: Array, densities: Array) -> None:
    """Filter a young track once more from a better beginning: where its own observations, smoothed,
    now put it.

    Its first rays met centimetres off if the landmark moved between them, and derivatives taken
    there make the estimate too sure.
    """
    node, mean, cov = ring.order[slot, 0], np.empty(6), np.empty((6, 6))
    if ring.camera[slot, node] >= 0 or not query(
        ring, slot, ring.time_s[slot, node], densities, mean, cov
    ):
        return
    ring.state[slot, node, :, :3] = mean[:3]
    for k in range(1, ring.filled[slot]):
        _filter(ring, slot, k, R, t, densities, np.empty((3, 3)))


@njit(cache=True)
def insert(
    ring: Ring,
    slot: int,
    time_s: float,
    camera: int,
    seen: Array,
    variances: Array,
    gate: float,
    R: Array,
    t: Array,
    densities: Array,
) -> int:
    """Take one observation of a running track into its place in time: ACCEPTED, or GATED, LATE,
    UNSEEN with the track unchanged.
    """
    place, count = _place(ring, slot, time_s), ring.filled[slot]
    if place == 0 or (place == 1 and count == NODES):
        return LATE
    order, noise = ring.order[slot], np.empty((3, 3))
    if count == NODES:
        spare = order[0]
        for k in range(NODES - 1):
            order[k] = order[k + 1]
        order[NODES - 1], place, count = spare, place - 1, count - 1
    node = order[count]
    for k in range(count, place, -1):
        order[k] = order[k - 1]
    order[place] = node
    ring.time_s[slot, node], ring.camera[slot, node] = time_s, camera
    ring.seen[slot, node], ring.variance[slot, node] = seen, variances
    nearest, ring.evidence[slot] = _filter(ring, slot, place, R, t, densities, noise)
    if nearest > gate:
        for k in range(place, count):
            order[k] = order[k + 1]
        order[count], ring.filled[slot] = node, count
        return GATED if nearest < np.inf else UNSEEN
    ring.filled[slot] = count + 1
    for k in range(place + 1, count + 1):
        _filter(ring, slot, k, R, t, densities, noise)
    if count + 1 in _YOUNG:
        _begin_again(ring, slot, R, t, densities)
    return ACCEPTED


@njit(cache=True)
def query_all(
    ring: Ring, time_s: float, densities: Array, means: Array, covs: Array
) -> npt.NDArray[np.bool_]:
    """Every landmark at one instant: which have an estimate (S,), with means (S, 6) and covs (S, 6,
    6) written in place.
    """
    found = np.zeros(ring.filled.shape[0], dtype=np.bool_)
    for slot in range(ring.filled.shape[0]):
        if ring.filled[slot] > 0:
            found[slot] = query(ring, slot, time_s, densities, means[slot], covs[slot])
    return found
