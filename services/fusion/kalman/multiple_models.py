"""Several Kalman filters side by side, from calm to lively, weighted by their likelihoods.

Multiple-model adaptive estimation (Magill, IEEE TAC 10(4), 1965): the motion models differ in their
jerk density, and in whether it is larger along the way that the landmark came. So a resting hand is
averaged and a fast one is followed, and the covariance is right for both. Each gates observations
for itself (model_choice.py). Compiled; nothing here raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.measurement import (
    NOT_VISIBLE,
    Innovation,
    Measurement,
    innovate,
    mahalanobis_squared,
    update,
)
from services.fusion.kalman.model_choice import (
    PASSED_OVER,
    choose_parents,
    count_strikes,
    update_probabilities,
)
from services.fusion.kalman.motion_model import discretize_next, empty_step, predict
from services.fusion.kalman.recent_way import add_noise_along, update_way
from services.fusion.kalman.track_history import (
    TrackHistory,
    filtered,
    innovation_of,
)


class Fit(NamedTuple):
    """How well an observation fits a track."""

    visible: bool  # some model has the landmark before the camera
    taken_by_any: bool
    taken: bool  # the likeliest model took it
    log_likelihood: float  # of all models, weighted as before the observation


@njit(cache=True, error_model="numpy")
def filter_node(
    history: TrackHistory,
    landmark: int,
    index: int,
    cameras: Extrinsics,
    models: Array,
    gate: float,
) -> Fit:
    """Predict, then update: all models' estimates after node `index` from the node before it.

    models (M, 4): as motion_model.discretize has them. gate: the largest squared Mahalanobis
    distance of an innovation that a model takes.
    """
    last = history.order[landmark, index - 1]
    node = history.order[landmark, index]
    camera = history.camera[landmark, node]
    measured = Measurement(
        cameras.R[camera],
        cameras.t[camera],
        history.ray[landmark, node],
        history.ray_variance[landmark, node],
        history.clock_variance[landmark, node],
    )
    dt_s = history.time_s[landmark, node] - history.time_s[landmark, last]
    prior = history.probability[landmark, last]
    parent = history.parent[landmark, node]
    choose_parents(prior, history.strikes[landmark, last], parent)
    step = empty_step()
    way = history.way[landmark, last]
    log_likelihoods = np.empty(models.shape[0])
    took = np.zeros(models.shape[0], dtype=np.bool_)
    for m in range(models.shape[0]):
        state = filtered(history, landmark, node, m)
        innovation = innovation_of(history, landmark, node, m)
        discretize_next(dt_s, models, m, step)
        predict(filtered(history, landmark, last, parent[m]), step, state)
        if models[m, 3] > 0.0:
            add_noise_along(way, step, models[m, 3] / models[m, 0], state)
        log_likelihoods[m] = innovate(state, measured, innovation)
        if log_likelihoods[m] == NOT_VISIBLE:
            _pass_over(innovation)
        elif mahalanobis_squared(innovation.nu, innovation.S_inverse) > gate:
            log_likelihoods[m] = PASSED_OVER
            _pass_over(innovation)
        else:
            update(state, innovation)
            took[m] = True
    posterior = history.probability[landmark, node]
    log_likelihood = update_probabilities(prior, log_likelihoods, posterior)
    likeliest = int(np.argmax(posterior))
    strikes = history.strikes[landmark, node]
    count_strikes(history.strikes[landmark, last], took, likeliest, strikes)
    update_way(way, history.state[landmark, node, likeliest], dt_s, history.way[landmark, node])
    visible = log_likelihoods.max() > NOT_VISIBLE
    return Fit(visible, bool(took.any()), bool(took[likeliest]), log_likelihood)


@njit(cache=True, error_model="numpy")
def _pass_over(innovation: Innovation) -> None:
    """An observation that a model does not take: it tells the smoother nothing."""
    innovation.H[:] = 0.0
    innovation.nu[:] = 0.0
    innovation.S_inverse[:] = 0.0
    innovation.K[:] = 0.0
