"""What each camera saw of each landmark lately: who has seen it, and rays to start a track from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
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


@njit(cache=True)
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
