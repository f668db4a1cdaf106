"""A hand's landmarks at any instant from all frames, before and after it.

Fixed-interval smoothing by the modified Bryson-Frazier recursion, for each model by itself: no
covariance is inverted, and none of a mixture is matched by a Gaussian on the way, which keeps it
stable a frame or two back. The information is kept as a factor, which grows by two rows a look.
Compiled; nothing here raises.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.kalman.history import HandHistory, nodes_until
from services.fusion.kalman.measurement import adjoint_update
from services.fusion.kalman.model_step import innovation_of
from services.fusion.kalman.motion.motion_models import (
    FAST_SUMS,
    RESTING,
    MotionModels,
    SharedNoise,
    add_walk,
    adjoint_predict,
    jerk_cov,
    predict_place_cov,
    predict_state,
    turn_gram,
    unit_process_noise,
)
from services.fusion.kalman.motion.own_motion import (
    add_own_to_places,
    carried_on,
    own_noise,
    transitions,
)
from services.fusion.kalman.motion.rigid_motion import body_transform

# Models less probable than this have no say in what is put out.
_LEAST = 1e-3


@njit(cache=True, error_model="numpy")
def smooth_hand(
    history: HandHistory, models: MotionModels, time_s: float, places: Array, covs: Array
) -> Bools:
    """Which landmarks (N,) have an estimate at an instant: places (N, 3), covs (N, 3, 3)."""
    count = history.alive.shape[1]
    index = nodes_until(history, time_s)
    if index == 0:
        return np.zeros(count, dtype=np.bool_)
    newest = history.order[history.size[0] - 1]
    probability = history.probability[newest]
    which = np.flatnonzero(probability > _LEAST)
    weights = probability[which] / probability[which].sum()
    model_places = np.empty((which.shape[0], count, 3))
    model_covs = np.empty((which.shape[0], count, 3, 3))
    for n in range(which.shape[0]):
        _smooth_model(history, models, index, which[n], time_s, model_places[n], model_covs[n])
    places[:] = 0.0
    covs[:] = 0.0
    for n in range(which.shape[0]):
        places += weights[n] * model_places[n]
    for n in range(which.shape[0]):
        for k in range(count):
            for i in range(3):
                for j in range(3):
                    spread = (model_places[n, k, i] - places[k, i]) * (
                        model_places[n, k, j] - places[k, j]
                    )
                    covs[k, i, j] += weights[n] * (model_covs[n, k, i, j] + spread)
    return history.alive[history.order[index - 1]].copy()


@njit(cache=True, error_model="numpy")
def _smooth_model(
    history: HandHistory,
    models: MotionModels,
    index: int,
    m: int,
    time_s: float,
    places: Array,
    covs: Array,
) -> None:
    """One model's places (N, 3) and covs (N, 3, 3) at time_s; nodes from `index` on are later."""
    size, count = history.state.shape[2], history.alive.shape[1]
    # The adjoint, and a factor of the information: two rows a look.
    rows = np.empty((1 + 2 * count * (history.size[0] - index), size))
    rows[0] = 0.0
    known = 1
    ends = m  # the model by which the state was predicted from the last node to time_s
    for k in range(history.size[0] - 1, index - 1, -1):
        node, before = history.order[k], history.order[k - 1]
        before_s = time_s if k == index else history.time_s[before]
        known = _adjoint_node(history, node, m, rows, known)
        dt_s = history.time_s[node] - before_s
        adjoint_predict(rows, known, transitions(models, m, history.carried[node, m], dt_s))
        ends, m = m, history.parent[node, m]
        if ends != m and k > index and ends == RESTING:
            T = body_transform(history.state[before, m], history.alive[before])
            rows[:known] = rows[:known] @ T
    x = np.empty(size)
    P = np.empty((3 * count, size))
    _predict_between(history, models, index, (ends, m), time_s, x, P)
    _combine(rows[:known], x, P, places, covs)


@njit(cache=True, error_model="numpy")
def _predict_between(
    history: HandHistory,
    models: MotionModels,
    index: int,
    model: tuple[int, int],
    time_s: float,
    x: Array,
    P: Array,
) -> None:
    """The prediction x (D,) at time_s from the node before `index`, and P (3 N, D) of places.

    model: the one that predicts, and the one whose estimate at that node it goes on from.
    """
    ends, m = model
    last = history.order[index - 1]
    alive = history.alive[last]
    dt_s = time_s - history.time_s[last]
    count = alive.shape[0]
    own, carried = np.empty(count), np.empty(count)
    if index < history.size[0]:
        node = history.order[index]
        own[:] = history.own[node, ends]
        carried[:] = history.carried[node, ends]
    else:
        for k in range(count):
            own[k] = carried_on(history.own[last, m, k], dt_s)
        carried[:] = own
    F = transitions(models, ends, carried, dt_s)
    before_x, before_P = history.state[last, m], history.cov[last, m]
    if ends != m and ends == RESTING:
        T = body_transform(before_x, alive)
        before_x, before_P = T @ before_x, T @ before_P @ T.T
    predict_state(before_x, F, x)
    gram = np.empty((3 * count, 3 * count))
    likeliest = int(np.argmax(history.probability[last]))
    turn_gram(history.state[last, likeliest], alive, gram)
    jerk = jerk_cov(models, ends, SharedNoise(gram, history.way[last]), alive)
    Q = np.empty((3, 3))
    unit_process_noise((models.velocity_rate[ends], models.acceleration_rate[ends]), dt_s, Q)
    predict_place_cov(before_P, F, jerk, Q, P)
    add_walk(models, ends, dt_s, alive, P)
    by_itself = np.empty((2, 3, 3))
    own_noise(models, ends, dt_s, by_itself)
    for k in range(count):
        if alive[k] and own[k] > 0.0:
            add_own_to_places(P, k, own[k], by_itself[1 if carried[k] > 0.0 else 0])


@njit(cache=True, error_model="numpy")
def _adjoint_node(history: HandHistory, node: int, m: int, rows: Array, known: int) -> int:
    """Back over a frame: its looks, and the landmarks that began with it; how many rows known."""
    count = history.alive.shape[1]
    for k in range(count - 1, -1, -1):
        if history.used_by[node, m, k]:
            delay_s = history.delay_s[node, k]
            known = adjoint_update(rows, known, k, delay_s, innovation_of(history, node, m, k))
    for k in range(count):
        if history.begins[node, k]:
            for r in range(3):
                for i in range(3):
                    rows[:known, 3 * count * r + 3 * k + i] = 0.0
    return known


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def _combine(rows: Array, x: Array, P: Array, places: Array, covs: Array) -> None:
    """x - P adjoint and P - P information P of the places: (N, 3), (N, 3, 3)."""
    known, size = rows.shape
    product = np.empty((3, known))
    for k in range(places.shape[0]):
        for i in range(3):
            row = P[3 * k + i]
            for n in range(known):
                total = 0.0
                for j in range(size):
                    total += row[j] * rows[n, j]
                product[i, n] = total
            places[k, i] = x[3 * k + i] - product[i, 0]
        for i in range(3):
            for j in range(3):
                reduction = 0.0
                for n in range(1, known):
                    reduction += product[i, n] * product[j, n]
                covs[k, i, j] = P[3 * k + i, 3 * k + j] - reduction
