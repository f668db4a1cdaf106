"""What a hand's filter knows at an instant: all of it in one compiled call."""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.frame_update import Sights, drop_lost
from services.fusion.kalman.history import HandHistory, nodes_until
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
        anew = _begins_after(history, k, time_s)
        for c in range(recent_s.size):
            accepted_s, observed_s = sights.accepted_s[k, c], sights.observed_s[k, c]
            if anew < history.size[0]:
                accepted_s, observed_s = _seen_before(history, k, c, anew)
            told.seen_by[k, c] = time_s - accepted_s <= recent_s[c]
            used += told.seen_by[k, c]
            looked += time_s - observed_s <= recent_s[c]
        told.measured[k] = used >= 2
        told.detected[k] = looked >= 2
        alone += told.found[k] and used < 2
    return lost, alone


@njit(cache=True, error_model="numpy")
def _begins_after(history: HandHistory, landmark: int, time_s: float) -> int:
    """Which frame after time_s a landmark begins anew with: looks from there on say nothing of
    time_s. How many frames there are if it goes on.
    """
    size = history.size[0]
    for index in range(nodes_until(history, time_s), size):
        if history.begins[history.order[index], landmark]:
            return index
    return size


@njit(cache=True, error_model="numpy")
def _seen_before(
    history: HandHistory, landmark: int, camera: int, index: int
) -> tuple[float, float]:
    """When a camera's look at a landmark was last used, and when it last looked, before a frame."""
    accepted_s, observed_s = -np.inf, -np.inf
    for before in range(index):
        node = history.order[before]
        if history.camera[node] == camera and history.looked[node, landmark]:
            at_s = history.time_s[node] + history.delay_s[node, landmark]
            observed_s = at_s
            if history.used[node, landmark]:
                accepted_s = at_s
    return accepted_s, observed_s
