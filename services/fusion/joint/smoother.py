"""A hand's landmarks at any instant from all frames, before and after it.

Fixed-interval smoothing by the modified Bryson-Frazier recursion, for each model by itself, as in
kalman/smoother.py: no covariance is inverted, and none of a mixture is matched by a Gaussian on the
way, which keeps it stable a frame or two back. Compiled; nothing here raises.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.joint.filtering import body_transform, innovation_of
from services.fusion.joint.history import HandHistory, nodes_until
from services.fusion.joint.measurement import adjoint_update
from services.fusion.joint.motion_models import (
    MotionModels,
    add_noise,
    adjoint_predict,
    predict_cov,
    predict_state,
    transition,
    turn_gram,
)

# Models less probable than this have no say in what is put out.
_LEAST = 1e-3


@njit(cache=True)
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


@njit(cache=True)
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
    size = history.state.shape[2]
    last = history.order[index - 1]
    adjoint = np.zeros(size)
    information = np.zeros((size, size))
    own = m  # the model by which the state was predicted to time_s
    for k in range(history.size[0] - 1, index - 1, -1):
        node = history.order[k]
        before = history.order[k - 1]
        before_s = time_s if k == index else history.time_s[before]
        _adjoint_node(history, node, m, adjoint, information)
        F = transition(models.rate[m], history.time_s[node] - before_s)
        adjoint_predict(adjoint, information, F)
        own, m = m, history.parent[node, m]
        if own != m and k > index and models.walk[own] > 0.0:
            T = body_transform(history.state[before, m], history.alive[before])
            adjoint[:] = T.T @ adjoint
            information[:] = T.T @ information @ T
    dt_s = time_s - history.time_s[last]
    x = np.empty(size)
    P = np.empty((size, size))
    F = transition(models.rate[own], dt_s)
    before_x, before_P = history.state[last, m], history.cov[last, m]
    if own != m and models.walk[own] > 0.0:
        T = body_transform(before_x, history.alive[last])
        before_x, before_P = T @ before_x, T @ before_P @ T.T
    predict_state(before_x, F, x)
    predict_cov(before_P, F, P)
    gram = np.empty((size // 3, size // 3))
    likeliest = int(np.argmax(history.probability[last]))
    turn_gram(history.state[last, likeliest], history.alive[last], gram)
    add_noise(models, own, dt_s, gram, history.alive[last], P)
    _apply(adjoint, information, x, P, places, covs)


@njit(cache=True)
def _adjoint_node(
    history: HandHistory, node: int, m: int, adjoint: Array, information: Array
) -> None:
    """Back over a frame: its looks, and the landmarks that began with it or ended."""
    count = history.alive.shape[1]
    for k in range(count - 1, -1, -1):
        if history.used_by[node, m, k]:
            delay_s = history.delay_s[node, k]
            adjoint_update(adjoint, information, k, delay_s, innovation_of(history, node, m, k))
    for k in range(count):
        if history.begins[node, k]:
            for r in range(3):
                for i in range(3):
                    at = 3 * count * r + 3 * k + i
                    adjoint[at] = 0.0
                    information[at] = 0.0
                    information[:, at] = 0.0


@njit(cache=True, error_model="numpy")
def _apply(
    adjoint: Array, information: Array, x: Array, P: Array, places: Array, covs: Array
) -> None:
    """x - P adjoint and P - P information P of the places: (N, 3), (N, 3, 3)."""
    size = x.shape[0]
    product = np.empty((3, size))
    for k in range(places.shape[0]):
        product[:] = 0.0
        for i in range(3):
            row = P[3 * k + i]
            total = 0.0
            for j in range(size):
                total += row[j] * adjoint[j]
                weight = row[j]
                for n in range(size):
                    product[i, n] += weight * information[j, n]
            places[k, i] = x[3 * k + i] - total
        for i in range(3):
            for j in range(3):
                reduction = 0.0
                for n in range(size):
                    reduction += product[i, n] * P[3 * k + j, n]
                covs[k, i, j] = P[3 * k + i, 3 * k + j] - reduction
