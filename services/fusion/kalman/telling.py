"""What the Kalman method tells of an instant: all landmarks, who sees them, and how sure that is.

One compiled call, as frame_update.py is of a frame: what a call from Python is given costs as much
as some landmarks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.kalman.frame_update import FilterState
from services.fusion.kalman.recent_observations import largest_sigmas, sights
from services.fusion.kalman.rest.rest_mixing import mix_rest
from services.fusion.kalman.shape.kept_shape import hold_shapes, learn_deformation
from services.fusion.kalman.smoother import smooth_all

# A camera counts as seeing a landmark if its last observation is not older than this many frames:
# one frame, and jitter.
SEEN_FRAMES = 1.6


class Telling(NamedTuple):
    """All L landmarks at an instant; arrays that `tell` fills."""

    means: Array  # (L, 3) positions, rig frame
    covs: Array  # (L, 3, 3)
    largest_sigmas: Array  # (L,) of the position's axes
    seen_by: Bools  # (L, C)
    are: Bools  # (4, L): found; seen by two cameras; detected by two; seen by one alone


def empty_telling(landmarks: int, cameras: int) -> Telling:
    """Nothing told yet."""
    return Telling(
        np.zeros((landmarks, 3)),
        np.zeros((landmarks, 3, 3)),
        np.zeros(landmarks),
        np.zeros((landmarks, cameras), dtype=np.bool_),
        np.zeros((4, landmarks), dtype=np.bool_),
    )


@njit(cache=True, error_model="numpy")
def tell(state: FilterState, time_s: float, since_s: Array, models: Array, told: Telling) -> None:
    """Fill told with the estimates at an instant.

    A camera sees what it has accepted since so long before (C,). models (M, 3): as
    motion_model.discretize has them.
    """
    history, rest, recent, shape = state
    found = smooth_all(history, time_s, models, told.means, told.covs)
    mix_rest(rest, time_s, found, told.means, told.covs)
    seen_by, measured, detected, alone = sights(
        recent.accepted_s, recent.observed_s, time_s, since_s
    )
    # The shape of a frame ago, of the fastest camera.
    span_s = since_s.min() / SEEN_FRAMES
    before = (np.zeros_like(told.means), np.zeros_like(told.covs))
    were = smooth_all(history, time_s - span_s, models, before[0], before[1])
    mix_rest(rest, time_s - span_s, were, before[0], before[1])
    learn_deformation(shape, rest.hand, were, before[0], time_s - span_s, span_s)
    hold_shapes(shape, rest.hand, found & were & measured, before, (told.means, told.covs))
    told.largest_sigmas[:] = largest_sigmas(told.means, told.covs, found)
    told.seen_by[:] = seen_by
    told.are[0], told.are[1], told.are[2], told.are[3] = found, measured, detected, alone
