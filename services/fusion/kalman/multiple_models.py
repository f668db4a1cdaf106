"""Several Kalman filters side by side, from calm to lively, weighted by their likelihoods.

Multiple-model adaptive estimation (Magill, IEEE TAC 10(4), 1965): the motion models differ in their
jerk density. So a resting hand is averaged and a fast one is followed, and the covariance is right
for both. Compiled; nothing here raises.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.measurement import (
    NOT_VISIBLE,
    Measurement,
    innovate,
    mahalanobis_squared,
    update,
)
from services.fusion.kalman.motion_model import predict, unit_process_noise
from services.fusion.kalman.track_history import (
    TrackHistory,
    filtered,
    innovation_of,
)

# Share of probability that leaks to the other models at each observation; keeps every model ready
# to take over within an observation or two.
_LEAK = 0.003


class Fit(NamedTuple):
    """How well an observation fits a track."""

    mahalanobis_squared: float  # of the best model; infinite if no model has it before the camera
    log_likelihood: float  # of all models, weighted as before the observation


@njit(cache=True)
def filter_node(
    history: TrackHistory, landmark: int, index: int, cameras: Extrinsics, densities: Array
) -> Fit:
    """Predict, then update: all models' estimates after node `index` from the node before it.

    densities (M,): the jerk densities of the motion models.
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
    unit_Q = np.empty((3, 3))
    unit_process_noise(dt_s, unit_Q)
    log_likelihoods = np.empty(densities.shape[0])
    nearest = np.inf
    for m in range(densities.shape[0]):
        state = filtered(history, landmark, node, m)
        innovation = innovation_of(history, landmark, node, m)
        predict(filtered(history, landmark, last, m), dt_s, densities[m], unit_Q, state)
        log_likelihoods[m] = innovate(state, measured, innovation)
        if log_likelihoods[m] > NOT_VISIBLE:
            nearest = min(nearest, mahalanobis_squared(innovation.nu, innovation.S_inverse))
            update(state, innovation)
        else:
            innovation.H[:] = 0.0
            innovation.nu[:] = 0.0
            innovation.S_inverse[:] = 0.0
            innovation.K[:] = 0.0
    prior = history.probability[landmark, last]
    posterior = history.probability[landmark, node]
    return Fit(nearest, _update_model_probabilities(prior, log_likelihoods, posterior))


@njit(cache=True)
def _update_model_probabilities(prior: Array, log_likelihoods: Array, posterior: Array) -> float:
    """Bayes' rule over models (M,), written to posterior (M,); returns the total log-likelihood."""
    models = prior.shape[0]
    best = NOT_VISIBLE
    for m in range(models):
        if log_likelihoods[m] > best:
            best = log_likelihoods[m]
    total = 0.0
    for m in range(models):
        leaked = (1.0 - _LEAK) * prior[m] + _LEAK / models
        posterior[m] = leaked * math.exp(max(log_likelihoods[m] - best, -700.0))
        total += posterior[m]
    posterior /= total
    return best + math.log(total)
