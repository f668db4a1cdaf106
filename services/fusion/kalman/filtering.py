"""A node filtered from the one before it: all models predicted, gated, updated and weighed.

Multiple-model adaptive estimation: a model is one motion of the whole hand, weighed by all
landmarks of a frame, beside which each landmark may move by itself (own_motion.py). A model that
has been improbable for long goes on from the likeliest one's estimate. Compiled; nothing here
raises.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.history import HandHistory, make_room, nodes_until
from services.fusion.kalman.measurement import (
    Innovation,
    Look,
    innovate,
    log_likelihood,
    shrink,
    take,
)
from services.fusion.kalman.motion_models import (
    RESTING,
    MotionModels,
    SharedNoise,
    add_walk,
    jerk_cov,
    predict_cov,
    predict_state,
    turn_gram,
    unit_process_noise,
    update_way,
)
from services.fusion.kalman.own_motion import (
    LOOK_ABOVE,
    add_own,
    carried_on,
    own_motion,
    own_noise,
    transitions,
)
from services.fusion.kalman.rigid_motion import body_transform

# Share of probability that leaks to the other models at each frame.
LEAK = 0.003
# A model less probable than this for so many frames goes on from the likeliest model's estimate.
# With 8, errors on the tuning half of points are 2 to 9 % smaller, but a hand that is suddenly a
# decimetre away has a finger begun 285 mm off.
BEHIND_BELOW, BEHIND_FRAMES = 0.02, 15
# Log-likelihood of a look that a model does not use: one look in 300 is of something else, anywhere
# in an image (rays x/z, y/z of about 1 by 1). So a model that explains five looks of a frame well
# and calls the sixth a stray one competes with a livelier one that explains all six, less well.
STRAY = math.log(0.003)
# The same landmark stray again, with no look in between that fits, is rather a motion that the
# model does not know: it costs so much more each time, to the third.
AGAIN = 30.0
# So many looks of a landmark in a row that a model passes over and the likeliest uses.
OUT = 2
# Sigmas of a new landmark's place about where its rays meet (m), of its speed (m/s) and of its
# acceleration (m/s^2), of which little is known yet.
START_SIGMAS = (0.3, 1.0, 10.0)


@njit(cache=True, error_model="numpy")
def filter_node(
    history: HandHistory, index: int, cameras: Extrinsics, models: MotionModels, gate: float
) -> None:
    """All estimates after node `index` (1 or more) from the node before it."""
    last = history.order[index - 1]
    node = history.order[index]
    dt_s = history.time_s[node] - history.time_s[last]
    before = history.alive[last]
    likeliest = int(np.argmax(history.probability[last]))
    gram = np.empty((3 * before.shape[0], 3 * before.shape[0]))
    turn_gram(history.state[last, likeliest], before, gram)
    shared = SharedNoise(gram, history.way[last])
    Q, by_itself = np.empty((3, 3)), np.empty((models.own.shape[0], 2, 3, 3))
    for m in range(models.own.shape[0]):
        parent = likeliest if _goes_on_from(history, last, m, likeliest) else m
        history.parent[node, m] = parent
        own = history.own[node, m]
        for k in range(own.shape[0]):
            own[k] = carried_on(history.own[last, parent, k], dt_s)
            history.carried[node, m, k] = own[k]
        x, P = history.state[node, m], history.cov[node, m]
        F = transitions(models, m, own, dt_s)
        jerk = jerk_cov(models, m, shared, before)
        unit_process_noise((models.velocity_rate[m], models.acceleration_rate[m]), dt_s, Q)
        if parent != m and m == RESTING:
            T = body_transform(history.state[last, parent], before)
            predict_state(T @ history.state[last, parent], F, x)
            predict_cov(T @ history.cov[last, parent] @ T.T, F, jerk, Q, P)
        else:
            predict_state(history.state[last, parent], F, x)
            predict_cov(history.cov[last, parent], F, jerk, Q, P)
        add_walk(models, m, dt_s, before, P)
        own_noise(models, m, dt_s, by_itself[m])
        for k in range(own.shape[0]):
            if before[k] and own[k] > 0.0:
                add_own(P, k, own[k], by_itself[m, 1])
    _begin(history, node, before)
    log_likelihoods = np.zeros(models.own.shape[0])
    for m in range(models.own.shape[0]):
        history.strikes[node, m] = history.strikes[last, history.parent[node, m]]
        noise = by_itself[m], models.own[m]
        log_likelihoods[m] = _update(history, node, m, cameras, gate, noise)
    _weigh(history, last, node, log_likelihoods)
    likeliest = int(np.argmax(history.probability[node]))
    alive, after = history.alive[node], history.way[node]
    update_way(history.way[last], history.state[node, likeliest], alive, dt_s, after)
    _end(history, node)


@njit(cache=True, error_model="numpy")
def _goes_on_from(history: HandHistory, last: int, m: int, likeliest: int) -> bool:
    """Whether a model gives its estimate up for the likeliest one's.

    It has been improbable for long; or it passes looks of a landmark over again and again that the
    likeliest uses: what it then has of that landmark grows so wide that one look sends it anywhere.
    """
    if history.behind[last, m] >= BEHIND_FRAMES:
        return True
    for k in range(history.strikes.shape[2]):
        if history.strikes[last, m, k] >= OUT and history.strikes[last, likeliest, k] == 0:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _begin(history: HandHistory, node: int, before: Bools) -> None:
    """Landmarks that begin at a node: nothing of what they were is left in any model."""
    axes = 3 * before.shape[0]
    for k in range(before.shape[0]):
        history.alive[node, k] = before[k] or history.begins[node, k]
        if not history.begins[node, k]:
            continue
        for m in range(history.state.shape[1]):
            x, P = history.state[node, m], history.cov[node, m]
            for r in range(3):
                for i in range(3):
                    at = r * axes + 3 * k + i
                    P[at] = 0.0
                    P[:, at] = 0.0
                    P[at, at] = START_SIGMAS[r] ** 2
                    x[at] = history.motion[node, k, 3 * r + i]


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
def _update(
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
    total = 0.0
    taken, known = np.empty((2 * history.looked.shape[1], x.shape[0])), 0
    for k in range(history.looked.shape[1]):
        history.used_by[node, m, k] = False
        if not (history.looked[node, k] and history.alive[node, k]):
            continue
        look, innovation = look_of(history, node, k, cameras), innovation_of(history, node, m, k)
        begins, strikes = history.begins[node, k], history.strikes[node, m, k]
        stray = STRAY - (0 if begins else min(strikes, 3)) * AGAIN
        far = gate if history.returns[node, k] else 0.0
        determinant = innovate(x, P, taken, known, look, far, innovation)
        price = 0.0
        if determinant > 0.0 and innovation.distance[0] > LOOK_ABOVE:
            Q = by_itself[1 if history.carried[node, m, k] > 0.0 else 0]
            own = own_motion(look, innovation, determinant, Q, usual)
            if own.density > 0.0:
                add_own(P, k, own.density, Q)
                history.own[node, m, k] += own.density
                price = own.price
                determinant = innovate(x, P, taken, known, look, 0.0, innovation)
        used = determinant > 0.0 and innovation.distance[0] <= gate
        history.used_by[node, m, k] = used
        if used:
            total += log_likelihood(innovation, determinant) - price
            known = take(x, taken, known, innovation)
            history.strikes[node, m, k] = 0
        else:
            total += stray
            history.strikes[node, m, k] = 1 if begins else strikes + 1
    shrink(P, taken, known)
    return total


@njit(cache=True, error_model="numpy")
def _weigh(history: HandHistory, last: int, node: int, log_likelihoods: Array) -> None:
    """Bayes' rule over the models, by a frame's log-likelihoods (M,)."""
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
    history: HandHistory, index: int, cameras: Extrinsics, models: MotionModels, gate: float
) -> None:
    """Filter a node and all later ones anew."""
    for later in range(index, history.size[0]):
        filter_node(history, later, cameras, models, gate)


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
