"""What each camera saw of each landmark lately: who has seen it, and rays to start a track from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.intake.frame_rays import FrameRays

# Observations of each camera that are kept for starting a track: half a second at 30 fps, so that a
# camera may be that much later than another.
KEPT = 16


class RecentObservations(NamedTuple):
    """The observations of L landmarks by C cameras, gated ones included."""

    accepted_s: Array  # (L, C) of the last one that a track accepted
    observed_s: Array  # (L, C) of the last one of all
    number: Ints  # (L, C) how many there were
    time_s: Array  # (L, C, KEPT) of the latest, in any order
    ray: Array  # (L, C, KEPT, 2)
    sigma: Array  # (L, C, KEPT) of each ray coordinate


def no_observations(landmarks: int, cameras: int) -> RecentObservations:
    """Nothing seen yet."""
    shape = (landmarks, cameras)
    return RecentObservations(
        accepted_s=np.full(shape, -np.inf),
        observed_s=np.full(shape, -np.inf),
        number=np.zeros(shape, dtype=np.int64),
        time_s=np.full((*shape, KEPT), -np.inf),
        ray=np.zeros((*shape, KEPT, 2)),
        sigma=np.zeros((*shape, KEPT)),
    )


@njit(cache=True, error_model="numpy")
def remember(recent: RecentObservations, frame: FrameRays) -> None:
    """Keep a frame's observations, in place of the oldest."""
    camera = frame.camera
    for n in range(frame.landmarks.shape[0]):
        landmark = frame.landmarks[n]
        k = recent.number[landmark, camera] % KEPT
        recent.time_s[landmark, camera, k] = frame.times_s[n]
        recent.ray[landmark, camera, k] = frame.rays[n]
        recent.sigma[landmark, camera, k] = frame.sigmas[n]
        recent.number[landmark, camera] += 1
        recent.observed_s[landmark, camera] = max(
            recent.observed_s[landmark, camera], frame.times_s[n]
        )


@njit(cache=True, error_model="numpy")
def alone_before(
    accepted_s: Array, landmarks: Ints, camera: int, times_s: Array, hold_s: float
) -> Bools:
    """Which of a camera's observations (n,) are of landmarks that another one saw alone for hold_s.

    accepted_s (L, C); landmarks and times_s (n,) of the observations.
    """
    alone = np.zeros(landmarks.size, dtype=np.bool_)
    for n in range(landmarks.size):
        fresh = times_s[n] - accepted_s[landmarks[n]] <= hold_s  # (C,)
        alone[n] = not fresh[camera] and np.count_nonzero(fresh) == 1
    return alone


@njit(cache=True, error_model="numpy")
def sights(
    accepted_s: Array, observed_s: Array, time_s: float, since_s: Array
) -> tuple[Bools, Bools, Bools, Bools]:
    """Who sees landmarks at an instant, by observations that are not older than since_s (C,).

    Which cameras do (L, C); whether two or more do, two or more detect something of its colour, and
    whether one does alone, (L,) each.
    """
    seen_by = time_s - accepted_s <= since_s
    detected_by = time_s - observed_s <= since_s
    seen, detected = seen_by.sum(axis=1), detected_by.sum(axis=1)
    return seen_by, seen >= 2, detected >= 2, seen == 1


@njit(cache=True, error_model="numpy")
def largest_sigmas(means: Array, covs: Array, found: Bools) -> Array:
    """The largest sigma of each position (L,); what is not a number is not found (L,) any more."""
    largest = np.zeros(found.size)
    for row in range(found.size):
        found[row] &= np.isfinite(means[row]).all()
        largest[row] = np.sqrt(max(covs[row, 0, 0], covs[row, 1, 1], covs[row, 2, 2]))
    return largest
