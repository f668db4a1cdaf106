"""One camera's observations into everything the filter keeps of them: looks, tracks (ring.py),
resting hands (rest.py).

One compiled call for a whole frame: calls and small arrays would cost more than the filters.
Kernels only; kalman.py owns the arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.kalman.rest_detection import weigh
from services.fusion.kalman.rigid_body import Rest
from services.fusion.kalman.track_history import ACCEPTED, Ring, insert
from services.fusion.method import Ints

# What `take_in` tells of a landmark without a track, beside the codes of ring.insert.
NO_TRACK = -1
# Looks of each camera that are kept for beginning a track: half a second at 30 fps, so that a
# camera may be that much later than another.
KEPT = 16


class Looks(NamedTuple):
    """What each of C cameras saw of each of S landmarks lately."""

    seen_s: Array  # (S, C) of the last observation a track accepted
    looked_s: Array  # (S, C) of the last one of all
    number: Ints  # (S, C) how many there were
    look_s: Array  # (S, C, KEPT) of the latest, in any order
    look: Array  # (S, C, KEPT, 3) their rays and sigmas


def no_looks(slots: int, cameras: int) -> Looks:
    """Nothing seen yet."""
    shape = (slots, cameras)
    return Looks(
        np.full(shape, -np.inf),
        np.full(shape, -np.inf),
        np.zeros(shape, dtype=np.int64),
        np.full((*shape, KEPT), -np.inf),
        np.zeros((*shape, KEPT, 3)),
    )


@njit(cache=True)
def _remember(
    looks: Looks, slot: int, camera: int, time_s: float, ray: Array, sigma: float
) -> None:
    k = looks.number[slot, camera] % KEPT
    (
        looks.look_s[slot, camera, k],
        looks.look[slot, camera, k, :2],
        looks.look[slot, camera, k, 2],
    ) = time_s, ray, sigma
    looks.number[slot, camera] += 1
    looks.looked_s[slot, camera] = max(looks.looked_s[slot, camera], time_s)


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
    fresh: bool,
) -> Ints:
    """A frame's observations (n,), rays (n, 2) with sigmas (n,): the codes (n,) of ring.insert,
    NO_TRACK where there is none.

    fresh: looks to remember, not remembered ones.
    R (C, 3, 3), t (C, 3) are every camera's T_camera_from_rig.
    """
    codes, variances = np.empty(slots.shape[0], dtype=np.int64), np.empty((slots.shape[0], 2))
    for n in range(slots.shape[0]):
        slot = slots[n]
        if fresh:
            _remember(looks, slot, camera, times_s[n], rays[n], sigmas[n])
        variances[n, 0], variances[n, 1] = sigmas[n] ** 2, clock_sigma_s**2
        codes[n] = NO_TRACK
        if ring.filled[slot] > 0:
            codes[n] = insert(
                ring, slot, times_s[n], camera, rays[n], variances[n], gate, R, t, densities
            )
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
