"""A hand's recent frames in order of time, with the estimate of every motion model after each.

A node is one camera's frame. So a frame that arrives late is inserted in its place and the later
ones are filtered again, a landmark may begin at an earlier frame than the one that showed it must,
and any instant within reach is smoothed by what came after it. hand_filter.py owns the arrays;
compiled functions change them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints

# Room for two frames of lag and for latency: frames of so long, but no fewer and no more than these
# (90 ms of four cameras at 90 fps). What is not there need not be in the processor's caches: rigs
# that take turns, 18 instead of 32 frames for each, cost 8 % less processor time.
_ROOM_S, _FEWEST, _MOST = 0.3, 16, 32


class HandHistory(NamedTuple):
    """Up to NODES frames (nodes_of) of N landmarks, M motion models; D = 9 N + 1
    (motion/motion_models.py).

    `order` lists the nodes (rows of storage) by time. The first is what all others build on.
    """

    size: Ints  # (1,) how many nodes there are; 0: nothing observed yet
    order: Ints  # (NODES,)
    incomplete: Bools  # (1,) the newest node is not filtered by all models yet
    time_s: Array  # (NODES,) mean of the frame's observations
    camera: Ints  # (NODES,)
    clock_variance: Array  # (NODES,) of the camera's clock, s^2
    looked: Bools  # (NODES, N) which landmarks the frame shows
    delay_s: Array  # (NODES, N) of each observation after the node's time
    ray: Array  # (NODES, N, 2)
    ray_variance: Array  # (NODES, N) of each ray coordinate
    begins: Bools  # (NODES, N) the landmark (re)starts here
    motion: Array  # (NODES, N, 9) from this mean
    ends: Bools  # (NODES, N) it is dropped after this node
    alive: Bools  # (NODES, N) it has an estimate
    used: Bools  # (NODES, N) its observation updated the likeliest model
    used_by: Bools  # (NODES, M, N) its observation updated this model
    strikes: Ints  # (NODES, M, N) how many of its latest looks in a row this model did not use
    passed: Ints  # (NODES, M, N, C) the same of each camera's latest looks in a row
    probability: Array  # (NODES, M) of each model
    log_likelihood: Array  # (NODES, M) of the frame's looks
    behind: Ints  # (NODES, M) how many frames it has been improbable
    way: Array  # (NODES, 3 N, 3 N) mean of v v^T over recent velocities (motion/motion_models.py)
    own: Array  # (NODES, M, N) density of each landmark's own jerk in the step here (own_motion)
    carried: Array  # (NODES, M, N) what of it was so before the frame's looks
    parent: Ints  # (NODES, M) the model whose estimate at the node before it was predicted from
    state: Array  # (NODES, M, D) filtered
    cov: Array  # (NODES, M, D, D)
    H: Array  # (NODES, M, N, 2, 3) Jacobian of the ray by the place, where one was used
    drift: Array  # (NODES, M, N, 2) Jacobian of the ray by the clock's error
    nu: Array  # (NODES, M, N, 2) the innovation
    distance: Array  # (NODES, M, N) the innovation's squared Mahalanobis distance
    S_inverse: Array  # (NODES, M, N, 2, 2) inverse of its covariance
    K: Array  # (NODES, M, N, 2, D) Kalman gain, transposed


def nodes_of(frames_per_s: float) -> int:
    """How many frames are kept, of cameras that deliver so many together."""
    return min(max(math.ceil(_ROOM_S * frames_per_s), _FEWEST), _MOST)


def empty_history(landmarks: int, models: int, nodes: int, cameras: int) -> HandHistory:
    """Nothing observed yet."""
    size = 9 * landmarks + 1
    each = (nodes, landmarks)
    by_model = (nodes, models)
    return HandHistory(
        size=np.zeros(1, dtype=np.int64),
        order=np.arange(nodes),
        incomplete=np.zeros(1, dtype=np.bool_),
        time_s=np.zeros(nodes),
        camera=np.full(nodes, -1),
        clock_variance=np.zeros(nodes),
        looked=np.zeros(each, dtype=np.bool_),
        delay_s=np.zeros(each),
        ray=np.zeros((*each, 2)),
        ray_variance=np.zeros(each),
        begins=np.zeros(each, dtype=np.bool_),
        motion=np.zeros((*each, 9)),
        ends=np.zeros(each, dtype=np.bool_),
        alive=np.zeros(each, dtype=np.bool_),
        used=np.zeros(each, dtype=np.bool_),
        used_by=np.zeros((*by_model, landmarks), dtype=np.bool_),
        strikes=np.zeros((*by_model, landmarks), dtype=np.int64),
        passed=np.zeros((*by_model, landmarks, cameras), dtype=np.int64),
        probability=np.full(by_model, 1.0 / models),
        log_likelihood=np.zeros(by_model),
        behind=np.zeros(by_model, dtype=np.int64),
        way=np.zeros((nodes, 3 * landmarks, 3 * landmarks)),
        own=np.zeros((*by_model, landmarks)),
        carried=np.zeros((*by_model, landmarks)),
        parent=np.zeros(by_model, dtype=np.int64),
        state=np.zeros((*by_model, size)),
        cov=np.zeros((*by_model, size, size)),
        H=np.zeros((*by_model, landmarks, 2, 3)),
        drift=np.zeros((*by_model, landmarks, 2)),
        nu=np.zeros((*by_model, landmarks, 2)),
        distance=np.zeros((*by_model, landmarks)),
        S_inverse=np.zeros((*by_model, landmarks, 2, 2)),
        K=np.zeros((*by_model, landmarks, 2, size)),
    )


@njit(cache=True)
def start_history(history: HandHistory, time_s: float) -> None:
    """A first node to build on: nothing is known at time_s; older nodes are forgotten."""
    node = history.order[0]
    history.size[0] = 1
    history.incomplete[0] = False
    history.time_s[node] = time_s
    history.camera[node] = -1
    clear_events(history, node)
    history.looked[node] = False
    history.alive[node] = False
    history.used[node] = False
    forget_models(history, node)
    history.strikes[node] = 0
    history.passed[node] = 0
    history.state[node] = 0.0
    history.way[node] = 0.0
    history.own[node] = 0.0
    history.cov[node] = 0.0


@njit(cache=True)
def forget_models(history: HandHistory, node: int) -> None:
    """Nothing is known at a node of how the hand moves.

    The liveliest first: with equal shares the first points of a moving hand are too sure.
    """
    models = history.probability.shape[1]
    history.probability[node] = 0.01
    history.probability[node, models - 1] = 1.0 - 0.01 * (models - 1)
    history.behind[node] = 0


@njit(cache=True)
def clear_events(history: HandHistory, node: int) -> None:
    """No landmark begins or ends at a node."""
    history.begins[node] = False
    history.ends[node] = False


@njit(cache=True)
def nodes_until(history: HandHistory, time_s: float) -> int:
    """How many nodes are not later than time_s."""
    index = history.size[0]
    while index > 0 and history.time_s[history.order[index - 1]] > time_s:
        index -= 1
    return index


@njit(cache=True)
def make_room(history: HandHistory, index: int) -> int:
    """Room for a node at `index` in the order of time, dropping the oldest where all are taken.

    Returns its index, one less if the oldest was dropped.
    """
    order = history.order
    size = min(history.size[0], order.shape[0] - 1)
    if history.size[0] == order.shape[0]:
        order[:] = np.roll(order, -1)
        index -= 1
    node = order[size]
    order[index + 1 : size + 1] = order[index:size].copy()
    order[index] = node
    history.size[0] = size + 1
    clear_events(history, node)
    return index
