"""What a hand's filter knows at an instant: all of it in one compiled call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.frame_update import Sights, drop_lost
from services.fusion.kalman.history import HandHistory
from services.fusion.kalman.motion_models import MotionModels
from services.fusion.kalman.smoother import smooth_hand


class Told(NamedTuple):
    """N landmarks at an instant, rig frame; arrays that tell() fills."""

    found: Bools  # (N,) whether it has an estimate
    places: Array  # (N, 3)
    covs: Array  # (N, 3, 3)
    seen_by: Bools  # (N, C) which cameras' looks at about that time were used
    measured: Bools  # (N,) of two cameras or more
    detected: Bools  # (N,) two cameras or more looked, used or not


def nothing_told(landmarks: int, cameras: int) -> Told:
    """To be filled by tell()."""
    flags = np.zeros((3, landmarks), dtype=np.bool_)
    return Told(
        found=flags[0],
        places=np.zeros((landmarks, 3)),
        covs=np.zeros((landmarks, 3, 3)),
        seen_by=np.zeros((landmarks, cameras), dtype=np.bool_),
        measured=flags[1],
        detected=flags[2],
    )


@njit(cache=True, error_model="numpy")
def tell(
    history: HandHistory,
    sights: Sights,
    cameras: Extrinsics,
    filters: tuple[MotionModels, float],
    time_s: float,
    since_s: Array,
    told: Told,
) -> int:
    """Fill told; how many landmarks were lost meanwhile.

    filters: the models, and the gate; since_s (C,): from when on a camera's look counts as of that
    instant.
    """
    lost = drop_lost(history, sights, cameras, filters, time_s)
    if history.size[0] > 0:
        told.found[:] = smooth_hand(history, filters[0], time_s, told.places, told.covs)
    for k in range(told.found.size):
        used, looked = 0, 0
        for c in range(since_s.size):
            told.seen_by[k, c] = sights.accepted_s[k, c] >= since_s[c]
            used += told.seen_by[k, c]
            looked += sights.observed_s[k, c] >= since_s[c]
        told.measured[k] = used >= 2
        told.detected[k] = looked >= 2
    return lost
