"""One camera's observations into everything the filter keeps of them: looks, tracks (ring.py), resting hands (rest.py).

One compiled call for a whole frame: calls and small arrays would cost more than the filters. Kernels only; kalman.py owns the arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.transforms import Array
from services.fusion.body import Ints, Rest
from services.fusion.rest import weigh
from services.fusion.ring import ACCEPTED, Ring, insert

# What `take_in` tells of a landmark without a track, beside the codes of ring.insert.
NO_TRACK = -1


class Looks(NamedTuple):
    """What each of C cameras saw last of each of S landmarks."""

    seen_s: Array  # (S, C) of the last observation a track accepted
    look_s: Array  # (S, C) of the last one of all, for beginning a track
    look: Array  # (S, C, 3) its ray and sigma


def no_looks(slots: int, cameras: int) -> Looks:
    """Nothing seen yet."""
    return Looks(np.full((slots, cameras), -np.inf), np.full((slots, cameras), -np.inf), np.zeros((slots, cameras, 3)))


@njit(cache=True)
def take_in(
    ring: Ring,
    rest: Rest,
    looks: Looks,
    slots: Ints,
    times_s: Array,
    camera: int,
    rays: Array,
    sigmas: Array,
    clock_sigma_s: float,
    gate: float,
    R: Array,
    t: Array,
    densities: Array,
) -> Ints:
    """A frame's observations (n,), rays (n, 2) with sigmas (n,): the codes (n,) of ring.insert, NO_TRACK where there is none.

    R (C, 3, 3), t (C, 3) are every camera's T_camera_from_rig.
    """
    codes, variances = np.empty(slots.shape[0], dtype=np.int64), np.empty((slots.shape[0], 2))
    for n in range(slots.shape[0]):
        slot = slots[n]
        looks.look_s[slot, camera], looks.look[slot, camera, :2], looks.look[slot, camera, 2] = times_s[n], rays[n], sigmas[n]
        variances[n, 0], variances[n, 1] = sigmas[n] ** 2, clock_sigma_s**2
        codes[n] = NO_TRACK
        if ring.filled[slot] > 0:
            codes[n] = insert(ring, slot, times_s[n], camera, rays[n], variances[n], gate, R, t, densities)
        if codes[n] == ACCEPTED:
            looks.seen_s[slot, camera] = max(looks.seen_s[slot, camera], times_s[n])
    weigh(rest, ring, slots, times_s, codes, camera, rays, variances, R, t)
    return codes


@njit(cache=True)
def drop(filled: Ints, belief: Array, seen_s: Array, before_s: float) -> int:
    """End the tracks that no two cameras have seen since before_s; how many."""
    dropped = 0
    for slot in range(filled.shape[0]):
        seen = 0
        for camera in range(seen_s.shape[1]):
            seen += seen_s[slot, camera] >= before_s
        if filled[slot] > 0 and seen < 2:
            filled[slot], belief[slot] = 0, 0.0
            dropped += 1
    return dropped
