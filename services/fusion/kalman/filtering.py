"""A node filtered from the one before it: all models predicted, gated, updated and weighed.

Multiple-model adaptive estimation: a model is one motion of the whole hand, weighed by all
landmarks of a frame, beside which each landmark may move by itself (motion/own_motion.py). A model
that has been improbable for long goes on from the likeliest one's estimate. Compiled; nothing here
raises.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from services.fusion.arrays import Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.history import HandHistory, make_room, nodes_until
from services.fusion.kalman.model_step import begin_landmarks, predict_model, update_model
from services.fusion.kalman.motion.motion_models import (
    MotionModels,
    SharedNoise,
    turn_gram,
    update_way,
)

# Share of probability that leaks to the other models at each frame.
LEAK = 0.003
# A model less probable than this for so many frames goes on from the likeliest model's estimate.
# With 8, errors on the tuning half of points are 2 to 9 % smaller, but a hand that is suddenly a
# decimetre away has a finger begun 285 mm off.
BEHIND_BELOW, BEHIND_FRAMES = 0.02, 15
# So many looks of a landmark in a row that a model passes over and the likeliest uses; so many of
# one camera, of whatever else it uses meanwhile. Of the latter 2, 4 and 7 were tried on tuning
# halves: 2 makes errors of points 1 to 4 % larger, with 7 one of two wild points is left.
OUT, OUT_OF_CAMERA = 2, 4
# Which models a node is filtered by. Points of a frame wait for those only that were more probable
# than this before it, and the others follow (complete_newest); for all where the squared distances
# of its looks are more than expected by this, two a look. Tuning half of points: 1.0 to 1.7 of six
# lead, and 75 to 99 % of frames wait for no more; what the others then get is below .06 in 99 % of
# those frames, but .25 to .6 of hands that grab, wave and flap, whose motion changes.
# (Not Python's own integers: numba would compile the filter once for each.)
ALL, LEADING, REST = np.int64(0), np.int64(1), np.int64(2)
LEADS_ABOVE, MORE_THAN_EXPECTED = 0.003, 8.0


@njit(cache=True, error_model="numpy")
def filter_node(
    history: HandHistory,
    index: int,
    cameras: Extrinsics,
    filters: tuple[MotionModels, float],
    which: np.int64,
) -> None:
    """Estimates after node `index` (1 or more) from the node before it; filters: models and gate.

    which: of ALL models, of those that were LEADING before, or of the REST, after those.
    """
    models, gate = filters
    last = history.order[index - 1]
    node = history.order[index]
    dt_s = history.time_s[node] - history.time_s[last]
    before = history.alive[last]
    for k in range(before.shape[0]):
        history.alive[node, k] = before[k] or history.begins[node, k]
    likeliest = int(np.argmax(history.probability[last]))
    gram = np.empty((3 * before.shape[0], 3 * before.shape[0]))
    turn_gram(history.state[last, likeliest], before, gram)
    shared = SharedNoise(gram, history.way[last])
    by_itself = np.empty((2, 3, 3))
    for m in range(models.own.shape[0]):
        if which != ALL and (which == LEADING) != _leads(history, last, m):
            if which == LEADING:
                history.log_likelihood[node, m] = -np.inf
            continue
        parent = likeliest if _goes_on_from(history, last, m, likeliest) else m
        history.parent[node, m] = parent
        predict_model(history, (last, node, m), models, shared, dt_s, by_itself)
        begin_landmarks(history, node, m)
        history.strikes[node, m] = history.strikes[last, parent]
        history.passed[node, m] = history.passed[last, parent]
        noise = by_itself, models.own[m]
        history.log_likelihood[node, m] = update_model(history, node, m, cameras, gate, noise)
    _weigh(history, last, node)
    likeliest = int(np.argmax(history.probability[node]))
    alive, after = history.alive[node], history.way[node]
    update_way(history.way[last], history.state[node, likeliest], alive, dt_s, after)
    _end(history, node)


@njit(cache=True, error_model="numpy")
def _leads(history: HandHistory, last: int, m: int) -> bool:
    """Whether model m is probable before a frame, by the node before it."""
    models = history.probability.shape[1]
    return (1.0 - LEAK) * history.probability[last, m] + LEAK / models > LEADS_ABOVE


@njit(cache=True, error_model="numpy")
def filter_inserted(
    history: HandHistory, index: int, cameras: Extrinsics, filters: tuple[MotionModels, float]
) -> None:
    """Filter a node that is new, and later ones anew.

    Of the newest, models that say nothing yet are left to complete_newest, where all looks are as
    the likeliest of the leading models expects.
    """
    if index < history.size[0] - 1:
        filter_from(history, index, cameras, filters)
        return
    filter_node(history, index, cameras, filters, LEADING)
    node = history.order[index]
    m = int(np.argmax(history.probability[node]))
    looks, distance, usual = 0, 0.0, True
    for k in range(history.looked.shape[1]):
        if history.looked[node, k] and history.alive[node, k]:
            usual &= history.used_by[node, m, k]
            usual &= history.own[node, m, k] <= history.carried[node, m, k]
            distance += history.distance[node, m, k]
            looks += 1
    history.incomplete[0] = True
    if not (usual and looks > 0 and distance <= 2.0 * looks + MORE_THAN_EXPECTED):
        complete_newest(history, cameras, filters)


@njit(cache=True, error_model="numpy")
def complete_newest(
    history: HandHistory, cameras: Extrinsics, filters: tuple[MotionModels, float]
) -> None:
    """What filter_inserted left: after it all is as if the node had been filtered at once."""
    if history.incomplete[0]:
        filter_node(history, history.size[0] - 1, cameras, filters, REST)
        history.incomplete[0] = False


@njit(cache=True, error_model="numpy")
def _goes_on_from(history: HandHistory, last: int, m: int, likeliest: int) -> bool:
    """Whether a model gives its estimate up for the likeliest one's.

    It has been improbable for long; or it passes looks of a landmark over again and again that the
    likeliest uses: what it then has of that landmark grows so wide that one look sends it anywhere.
    Or it does so with one camera's, and those of another, all of which it uses, lead it off along
    their rays: it is as probable as any then in each other frame, and decimetres off.
    """
    if history.behind[last, m] >= BEHIND_FRAMES:
        return True
    _, _, landmarks, cameras = history.passed.shape
    for k in range(landmarks):
        if history.strikes[last, m, k] >= OUT and history.strikes[last, likeliest, k] == 0:
            return True
        for c in range(cameras):
            if (
                history.passed[last, m, k, c] >= OUT_OF_CAMERA
                and history.passed[last, likeliest, k, c] == 0
            ):
                return True
    return False


@njit(cache=True, error_model="numpy")
def _end(history: HandHistory, node: int) -> None:
    """Landmarks that end with a node: no model holds anything of them."""
    count = history.alive.shape[1]
    for k in range(count):
        if history.ends[node, k]:
            history.alive[node, k] = False
            for m in range(history.state.shape[1]):
                for r in range(3):
                    for i in range(3):
                        at = 3 * r * count + 3 * k + i
                        history.cov[node, m, at] = 0.0
                        history.cov[node, m, :, at] = 0.0


@njit(cache=True, error_model="numpy")
def _weigh(history: HandHistory, last: int, node: int) -> None:
    """Bayes' rule over the models, by a frame's log-likelihoods."""
    log_likelihoods = history.log_likelihood[node]
    prior, posterior = history.probability[last], history.probability[node]
    models = prior.shape[0]
    best = log_likelihoods.max()
    total = 0.0
    for m in range(models):
        leaked = (1.0 - LEAK) * prior[m] + LEAK / models
        posterior[m] = leaked * math.exp(max(log_likelihoods[m] - best, -700.0))
        total += posterior[m]
    for m in range(models):
        posterior[m] /= total
        behind = history.behind[last, m] + 1 if history.parent[node, m] == m else 0
        history.behind[node, m] = behind if posterior[m] < BEHIND_BELOW else 0
    history.used[node] = history.used_by[node, int(np.argmax(posterior))]


@njit(cache=True, error_model="numpy")
def insert_frame(history: HandHistory, time_s: float, camera: int, clock_variance: float) -> int:
    """Room for a frame where it belongs in time; its index, or -1 if it is too late.

    Its looks are the caller's to write, and to filter (filter_from).
    """
    index = nodes_until(history, time_s)
    if index == 0 or (index == 1 and history.size[0] == history.order.shape[0]):
        return -1
    index = make_room(history, index)
    node = history.order[index]
    history.time_s[node] = time_s
    history.camera[node] = camera
    history.clock_variance[node] = clock_variance
    return index


@njit(cache=True, error_model="numpy")
def filter_from(
    history: HandHistory, index: int, cameras: Extrinsics, filters: tuple[MotionModels, float]
) -> None:
    """Filter a node and all later ones anew; filters: models and gate."""
    for later in range(index, history.size[0]):
        filter_node(history, later, cameras, filters, ALL)
    history.incomplete[0] = False


@njit(cache=True, error_model="numpy")
def oldest_with(history: HandHistory, landmark: int, since_s: float) -> Ints:
    """Indices of nodes, none the first, that show a landmark at since_s or later."""
    found = np.zeros(history.size[0], dtype=np.int64)
    count = 0
    for index in range(1, history.size[0]):
        node = history.order[index]
        if history.looked[node, landmark] and history.time_s[node] >= since_s:
            found[count] = index
            count += 1
    return found[:count]
