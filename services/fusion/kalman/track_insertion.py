"""An observation inserted into its landmark's track, wherever in time it belongs.

One that arrives late is put in its place, and the later ones are filtered again; one older than the
whole history is refused. What contradicts the track is gated by its innovation. Compiled; nothing
here raises: codes tell what happened.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.intake.frame_rays import Observation
from services.fusion.kalman.multiple_models import filter_node
from services.fusion.kalman.smoother import Place, smooth_one
from services.fusion.kalman.track_history import (
    NODES,
    TrackHistory,
    nodes_until,
)

# What became of an observation. NOT_SEEN: no model has the landmark in front of the camera.
ACCEPTED, GATED, LATE, NOT_SEEN = 0, 1, 2, 3
# Sizes (prior included) at which a track is restarted from a better prior: once four, then seven
# observations tell where it was. Without it, the second and third point of new tracks were off by
# 3.9 and 1.6 sigmas (one frame of lag), with it by 2.6 and 1.3.
_RESTART_SIZES = (4, 6)


@njit(cache=True, error_model="numpy")
def insert(
    history: TrackHistory,
    landmark: int,
    observed: Observation,
    gate: float,
    cameras: Extrinsics,
    models: Array,
) -> int:
    """Filter one observation into a running track: ACCEPTED, or GATED, LATE, NOT_SEEN.

    gate is the largest squared Mahalanobis distance of an innovation that a model takes; models
    (M, 4) as motion_model.discretize has them. GATED: the likeliest model did not take it. What no
    model takes leaves the track unchanged, but for the oldest node of a full one.
    """
    index = nodes_until(history, landmark, observed.time_s)
    if index == 0 or (index == 1 and history.size[landmark] == NODES):
        return LATE
    index = _insert_node(history, landmark, index, observed)
    fit = filter_node(history, landmark, index, cameras, models, gate)
    history.log_likelihood[landmark] = fit.log_likelihood
    if not fit.taken_by_any:
        _remove_node(history, landmark, index)
        return GATED if fit.visible else NOT_SEEN
    for later in range(index + 1, history.size[landmark]):
        filter_node(history, landmark, later, cameras, models, gate)
    if history.size[landmark] in _RESTART_SIZES:
        _restart_from_smoothed_prior(history, landmark, cameras, models, gate)
    return ACCEPTED if fit.taken else GATED


@njit(cache=True, error_model="numpy")
def _insert_node(history: TrackHistory, landmark: int, index: int, observed: Observation) -> int:
    """Make room at `index` in the order of time, dropping the oldest of a full track.

    Returns the new node's index, one less if the oldest was dropped.
    """
    order = history.order[landmark]
    size = history.size[landmark]
    if size == NODES:
        oldest = order[0]
        for k in range(NODES - 1):
            order[k] = order[k + 1]
        order[NODES - 1] = oldest
        index -= 1
        size -= 1
    node = order[size]
    for k in range(size, index, -1):
        order[k] = order[k - 1]
    order[index] = node
    history.size[landmark] = size + 1
    history.time_s[landmark, node] = observed.time_s
    history.camera[landmark, node] = observed.camera
    history.ray[landmark, node] = observed.ray
    history.ray_variance[landmark, node] = observed.ray_variance
    history.clock_variance[landmark, node] = observed.clock_variance
    return index


@njit(cache=True, error_model="numpy")
def _remove_node(history: TrackHistory, landmark: int, index: int) -> None:
    """Take a node out of the order of time; its row becomes the first free one."""
    order = history.order[landmark]
    node = order[index]
    newest = history.size[landmark] - 1
    for k in range(index, newest):
        order[k] = order[k + 1]
    order[newest] = node
    history.size[landmark] = newest


@njit(cache=True, error_model="numpy")
def _restart_from_smoothed_prior(
    history: TrackHistory, landmark: int, cameras: Extrinsics, models: Array, gate: float
) -> None:
    """Filter a young track once more, from where its own observations, smoothed, put its beginning.

    Its first rays met centimetres off if the landmark moved between them. Jacobians taken there
    make the estimate too sure.
    """
    node = history.order[landmark, 0]
    prior = Place(np.empty(3), np.empty((3, 3)))
    if history.camera[landmark, node] >= 0 or not smooth_one(
        history, landmark, history.time_s[landmark, node], models, prior
    ):
        return
    history.state[landmark, node, :, :3] = prior.mean
    for index in range(1, history.size[landmark]):
        filter_node(history, landmark, index, cameras, models, gate)
