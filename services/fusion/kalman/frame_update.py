"""One frame's observations into everything the Kalman method keeps: recent ones, tracks, rest.

One compiled call for a whole frame: calls and small arrays would cost more than the filters.
kalman/estimator.py owns the arrays; nothing here raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.intake.frame_rays import FrameRays, observation
from services.fusion.kalman.recent_observations import (
    RecentObservations,
    no_observations,
    remember,
)
from services.fusion.kalman.rest.rest_detection import update_rest
from services.fusion.kalman.rest.rigid_body import RestState, empty_rest
from services.fusion.kalman.shape.kept_shape import ShapeMemory, empty_memory
from services.fusion.kalman.track_history import TrackHistory, empty_history
from services.fusion.kalman.track_insertion import ACCEPTED, insert

# What `update_frame` returns for a landmark without a track, beside the codes of
# track_insertion.insert.
NO_TRACK = -1


class FilterState(NamedTuple):
    """All that the Kalman method remembers of L landmarks."""

    history: TrackHistory
    rest: RestState
    recent: RecentObservations
    shape: ShapeMemory


def empty_state(hands: list[Ints], centres_rig: Array, models: int) -> FilterState:
    """Nothing observed yet by cameras at centres_rig (C, 3).

    hands: the indices of each hand's landmarks, 0 to L - 1 in all.
    """
    landmarks = sum(map(len, hands))
    return FilterState(
        empty_history(landmarks, models),
        empty_rest(hands),
        no_observations(landmarks, len(centres_rig)),
        empty_memory(landmarks, centres_rig.mean(axis=0)),
    )


@njit(cache=True, error_model="numpy")
def update_frame(
    state: FilterState,
    frame: FrameRays,
    cameras: Extrinsics,
    models: Array,
    gate: float,
    new: bool,
) -> Ints:
    """Take in a frame; returns what became of its observations (n,), NO_TRACK where there is none.

    models (M, 4): as motion_model.discretize has them. gate: the largest squared Mahalanobis
    distance that a model takes. new: observations to remember, not remembered ones.
    """
    if new:
        remember(state.recent, frame)
    codes = np.full(frame.landmarks.shape[0], NO_TRACK)
    for n in range(frame.landmarks.shape[0]):
        landmark = frame.landmarks[n]
        if state.history.size[landmark] > 0:
            observed = observation(frame, n)
            codes[n] = insert(state.history, landmark, observed, gate, cameras, models)
        if codes[n] == ACCEPTED:
            accepted_s = state.recent.accepted_s[landmark]  # (C,)
            accepted_s[frame.camera] = max(accepted_s[frame.camera], frame.times_s[n])
    update_rest(state.rest, state.history, frame, codes, cameras)
    return codes


@njit(cache=True, error_model="numpy")
def drop_lost_tracks(
    size: Ints, probability: Array, accepted_s: Array, observed_s: Array, before_s: float
) -> int:
    """End the tracks that no camera has seen since before_s, or one while another disagrees.

    Another that sees nothing does not disagree: one camera is enough for a while. Returns how many.
    size (L,) of their history, probability (L,) of rest, accepted_s and observed_s (L, C) of recent
    observations: these alone, as each array that a compiled call is given costs a tenth of a
    microsecond.
    """
    dropped = 0
    for landmark in range(accepted_s.shape[0]):
        seen_by, detected_by = 0, 0
        for camera in range(accepted_s.shape[1]):
            seen_by += accepted_s[landmark, camera] >= before_s
            detected_by += observed_s[landmark, camera] >= before_s
        if size[landmark] > 0 and seen_by < min(max(detected_by, 1), 2):
            size[landmark] = 0
            probability[landmark] = 0.0
            dropped += 1
    return dropped
