"""The recent observations of every landmark in order of time, with the filtered estimates.

Each landmark's track keeps its last NODES observations, and the estimate of every motion model
after each. So an observation that arrives late is inserted in its place (track_insertion.py), and
any instant within reach is smoothed by what came after it (smoother.py). kalman/estimator.py owns
the arrays; compiled functions change them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.kalman.measurement import Innovation
from services.fusion.kalman.motion_model import Gaussian
from services.fusion.kalman.recent_way import unknown_way

# 32 observations are .53 s of two cameras at 30 fps and 90 ms of four at 90 fps: room for two
# frames of lag and for latency.
NODES = 32


class TrackHistory(NamedTuple):
    """The tracks of L landmarks: up to NODES observations each, M motion models.

    `order` lists a landmark's nodes (rows of storage) by time. The first node of a new track is its
    prior.
    """

    size: Ints  # (L,) how many nodes each landmark has; 0: no track
    order: Ints  # (L, NODES)
    time_s: Array  # (L, NODES)
    camera: Ints  # (L, NODES), -1: the prior
    ray: Array  # (L, NODES, 2) as observed
    ray_variance: Array  # (L, NODES) of each ray coordinate
    clock_variance: Array  # (L, NODES) of the camera's clock, s^2
    probability: Array  # (L, NODES, M) of each model
    strikes: Ints  # (L, NODES, M) model_choice.count_strikes
    parent: Ints  # (L, NODES, M) from which model's estimate at the node before each one goes on
    way: Array  # (L, NODES, 3, 3) recent_way.py
    state: Array  # (L, NODES, M, 9) filtered
    cov: Array  # (L, NODES, M, 9, 9)
    H: Array  # (L, NODES, M, 2, 3) and what follows: measurement.Innovation
    nu: Array  # (L, NODES, M, 2)
    S_inverse: Array  # (L, NODES, M, 2, 2)
    K: Array  # (L, NODES, M, 9, 2)
    log_likelihood: Array  # (L,) of the latest inserted observation, by all models as weighted then


def empty_history(landmarks: int, models: int) -> TrackHistory:
    """No tracks yet."""
    nodes = (landmarks, NODES)
    return TrackHistory(
        size=np.zeros(landmarks, dtype=np.int64),
        order=np.tile(np.arange(NODES), (landmarks, 1)),
        time_s=np.zeros(nodes),
        camera=np.full(nodes, -1),
        ray=np.zeros((*nodes, 2)),
        ray_variance=np.zeros(nodes),
        clock_variance=np.zeros(nodes),
        probability=np.zeros((*nodes, models)),
        strikes=np.zeros((*nodes, models), dtype=np.int64),
        parent=np.zeros((*nodes, models), dtype=np.int64),
        way=np.zeros((*nodes, 3, 3)),
        state=np.zeros((*nodes, models, 9)),
        cov=np.zeros((*nodes, models, 9, 9)),
        H=np.zeros((*nodes, models, 2, 3)),
        nu=np.zeros((*nodes, models, 2)),
        S_inverse=np.zeros((*nodes, models, 2, 2)),
        K=np.zeros((*nodes, models, 9, 2)),
        log_likelihood=np.zeros(landmarks),
    )


@njit(cache=True, error_model="numpy")
def start_track(
    history: TrackHistory, landmark: int, time_s: float, p_rig: Array, sigmas: Array
) -> None:
    """Begin a track at a point (3,); older nodes are forgotten.

    sigmas (3,): the prior's, of position, velocity and acceleration.
    """
    node = history.order[landmark, 0]
    history.size[landmark] = 1
    history.time_s[landmark, node] = time_s
    history.camera[landmark, node] = -1
    models = history.probability.shape[2]
    # The liveliest model first: with equal shares, the second point of new tracks was off by 2.6 of
    # its sigmas, so by 2.1.
    history.probability[landmark, node] = 0.01
    history.probability[landmark, node, models - 1] = 1.0 - 0.01 * (models - 1)
    history.strikes[landmark, node] = 0
    unknown_way(history.way[landmark, node])
    history.state[landmark, node] = 0.0
    history.cov[landmark, node] = 0.0
    for m in range(models):
        for axis in range(3):
            history.state[landmark, node, m, axis] = p_rig[axis]
            for k in range(3):
                history.cov[landmark, node, m, 3 * k + axis, 3 * k + axis] = sigmas[k] ** 2


@njit(cache=True, error_model="numpy")
def nodes_until(history: TrackHistory, landmark: int, time_s: float) -> int:
    """How many nodes of a track are not later than time_s."""
    index = history.size[landmark]
    while index > 0 and history.time_s[landmark, history.order[landmark, index - 1]] > time_s:
        index -= 1
    return index


@njit(cache=True, error_model="numpy")
def newest_node(history: TrackHistory, landmark: int) -> int:
    """The latest node of a track; there must be one."""
    return history.order[landmark, history.size[landmark] - 1]


@njit(cache=True, error_model="numpy")
def filtered(history: TrackHistory, landmark: int, node: int, m: int) -> Gaussian:
    """Model m's estimate after a node; views, to read or to write."""
    return Gaussian(history.state[landmark, node, m], history.cov[landmark, node, m])


@njit(cache=True, error_model="numpy")
def innovation_of(history: TrackHistory, landmark: int, node: int, m: int) -> Innovation:
    """Model m's innovation at a node; views, to read or to write."""
    return Innovation(
        history.H[landmark, node, m],
        history.nu[landmark, node, m],
        history.S_inverse[landmark, node, m],
        history.K[landmark, node, m],
    )
