"""What a hand's filter knows at an instant: all of it in one compiled call."""

from __future__ import annotations

from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.frame_update import Sights, drop_lost
from services.fusion.kalman.history import HandHistory
from services.fusion.kalman.motion.motion_models import MotionModels
from services.fusion.kalman.smoother import smooth_hand
from services.fusion.method import Estimates


@njit(cache=True, error_model="numpy")
def tell(
    history: HandHistory,
    sights: Sights,
    cameras: Extrinsics,
    filters: tuple[MotionModels, float],
    time_s: float,
    recent_s: Array,
    told: Estimates,
) -> tuple[int, int]:
    """Fill told; how many landmarks were lost meanwhile, and how many no two cameras see.

    filters: the models, and the gate; recent_s (C,): so old a camera's look may be to count as of
    that instant.
    """
    lost = drop_lost(history, sights, cameras, filters, time_s)
    told.found[:] = False
    if history.size[0] > 0:
        places, covs = told.positions_m, told.covariances_m2
        told.found[:] = smooth_hand(history, filters[0], time_s, places, covs)
    alone = 0
    for k in range(told.found.size):
        used, looked = 0, 0
        for c in range(recent_s.size):
            told.seen_by[k, c] = time_s - sights.accepted_s[k, c] <= recent_s[c]
            used += told.seen_by[k, c]
            looked += time_s - sights.observed_s[k, c] <= recent_s[c]
        told.measured[k] = used >= 2
        told.detected[k] = looked >= 2
        alone += told.found[k] and used < 2
    return lost, alone
