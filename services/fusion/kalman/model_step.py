"""One model of a hand's motion over one node: predicted, gated, updated by its looks. Compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.history import HandHistory
from services.fusion.kalman.measurement import (
    Innovation,
    Look,
    innovate,
    log_likelihood,
    shrink,
    take,
)
from services.fusion.kalman.motion.motion_models import (
    RESTING,
    MotionModels,
    SharedNoise,
    add_walk,
    jerk_cov,
    predict_cov,
    predict_state,
    unit_process_noise,
)
from services.fusion.kalman.motion.own_motion import (
    LOOK_ABOVE,
    add_own,
    carried_on,
    own_motion,
    own_noise,
    transitions,
)
from services.fusion.kalman.motion.rigid_motion import body_transform
from services.fusion.kalman.relinearise import linearise_where_it_leads

# Log-likelihood of a look that a model does not use: one look in 300 is of something else, anywhere
# in an image (rays x/z, y/z of about 1 by 1). So a model that explains five looks of a frame well
# and calls the sixth a stray one competes with a livelier one that explains all six, less well.
STRAY = math.log(0.003)
# The same landmark stray again, with no look in between that fits, is rather a motion that the
# model does not know: it costs so much more each time, to the third.
AGAIN = 30.0
# Sigmas of a new landmark's place about where its rays meet (m), of its speed (m/s) and of its
# acceleration (m/s^2), of which little is known yet.
START_SIGMAS = (0.3, 1.0, 10.0)


@njit(cache=True, error_model="numpy")
def predict_model(
    history: HandHistory,
    at: tuple[int, int, int],
    models: MotionModels,
    shared: SharedNoise,
    dt_s: float,
    by_itself: Array,
) -> None:
    """A model's estimate at a node before its looks, and to by_itself its own_noise.

    at: the node before, the node, the model.
    """
    last, node, m = at
    parent = history.parent[node, m]
    before, own = history.alive[last], history.own[node, m]
    for k in range(own.shape[0]):
        own[k] = carried_on(history.own[last, parent, k], dt_s)
        history.carried[node, m, k] = own[k]
    x, P = history.state[node, m], history.cov[node, m]
    F = transitions(models, m, own, dt_s)
    jerk = jerk_cov(models, m, shared, before)
    Q = np.empty((3, 3))
    unit_process_noise((models.velocity_rate[m], models.acceleration_rate[m]), dt_s, Q)
    if parent != m and m == RESTING:
        T = body_transform(history.state[last, parent], before)
        predict_state(T @ history.state[last, parent], F, x)
        predict_cov(T @ history.cov[last, parent] @ T.T, F, jerk, Q, P)
    else:
        predict_state(history.state[last, parent], F, x)
        predict_cov(history.cov[last, parent], F, jerk, Q, P)
    add_walk(models, m, dt_s, before, P)
    own_noise(models, m, dt_s, by_itself)
    for k in range(own.shape[0]):
        if before[k] and own[k] > 0.0:
            add_own(P, k, own[k], by_itself[1])


@njit(cache=True, error_model="numpy")
def begin_landmarks(history: HandHistory, node: int, m: int) -> None:
    """Landmarks that begin at a node: nothing of what they were is left in a model."""
    axes = 3 * history.begins.shape[1]
    x, P = history.state[node, m], history.cov[node, m]
    for k in range(history.begins.shape[1]):
        if not history.begins[node, k]:
            continue
        for r in range(3):
            for i in range(3):
                at = r * axes + 3 * k + i
                P[at] = 0.0
                P[:, at] = 0.0
                P[at, at] = START_SIGMAS[r] ** 2
                x[at] = history.motion[node, k, 3 * r + i]


@njit(cache=True, error_model="numpy")
def look_of(history: HandHistory, node: int, k: int, cameras: Extrinsics) -> Look:
    """The observation of landmark k in a node's frame."""
    camera = history.camera[node]
    return Look(
        k,
        history.delay_s[node, k],
        history.ray[node, k],
        history.ray_variance[node, k],
        cameras.R[camera],
        cameras.t[camera],
    )


@njit(cache=True, error_model="numpy")
def innovation_of(history: HandHistory, node: int, m: int, k: int) -> Innovation:
    """Model m's innovation by landmark k at a node; views, to read or to write."""
    return Innovation(
        history.H[node, m, k],
        history.drift[node, m, k],
        history.nu[node, m, k],
        history.S_inverse[node, m, k],
        history.K[node, m, k],
        history.distance[node, m, k : k + 1],
    )


@njit(cache=True, error_model="numpy")
def update_model(
    history: HandHistory,
    node: int,
    m: int,
    cameras: Extrinsics,
    gate: float,
    noise: tuple[Array, float],
) -> float:
    """Update a model by the looks within its gate; the log-likelihood of all.

    noise: of own_noise since the node before (2, 3, 3), and the density that the model has for all.
    """
    by_itself, usual = noise
    x, P = history.state[node, m], history.cov[node, m]
    clock = x.shape[0] - 1
    P[clock, clock] = history.clock_variance[node]
    total, camera = 0.0, history.camera[node]
    taken, known = np.empty((2 * history.looked.shape[1], x.shape[0])), 0
    for k in range(history.looked.shape[1]):
        history.used_by[node, m, k] = False
        if not (history.looked[node, k] and history.alive[node, k]):
            continue
        look, innovation = look_of(history, node, k, cameras), innovation_of(history, node, m, k)
        begins, strikes = history.begins[node, k], history.strikes[node, m, k]
        passed = history.passed[node, m, k]
        if begins:
            passed[:] = 0
        stray = STRAY - (0 if begins else min(strikes, 3)) * AGAIN
        determinant = innovate(x, P, taken, known, look, innovation)
        price = 0.0
        if determinant > 0.0 and innovation.distance[0] > LOOK_ABOVE:
            Q = by_itself[1 if history.carried[node, m, k] > 0.0 else 0]
            own = own_motion(look, innovation, determinant, Q, usual)
            if own.density > 0.0:
                add_own(P, k, own.density, Q)
                history.own[node, m, k] += own.density
                price = own.price
                determinant = innovate(x, P, taken, known, look, innovation)
        used = determinant > 0.0 and innovation.distance[0] <= gate
        history.used_by[node, m, k] = used
        if used:
            total += log_likelihood(innovation, determinant) - price
            linearise_where_it_leads(x, P, taken, known, look, innovation)
            known = take(x, taken, known, innovation)
            history.strikes[node, m, k] = passed[camera] = 0
        else:
            total += stray
            history.strikes[node, m, k] = 1 if begins else strikes + 1
            passed[camera] += 1
    shrink(P, taken, known)
    return total
