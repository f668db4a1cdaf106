"""The simple methods: bring the views to one instant first, then triangulate (or apply the
disparity law), then filter.

What a result needs from later frames it waits for (pairing.FRAMES_AFTER); a landmark whose views
cannot be brought together, or whose rays do not meet, is held where it was as `predicted` with a
sigma that grows at SPEED_SIGMA, and dropped after hold_s.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rhot.files.config import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.triangulation import (
    Triangulation,
    TriangulationStatus,
    extrinsics,
    triangulate,
)
from services.fusion.intake.observations import View
from services.fusion.intake.ray_interpolation import FRAMES_AFTER, Ray, RayTrack
from services.fusion.method import Counts, Estimates
from services.fusion.paired.depth_law import RectifiedPair, depth_law, locate, rectified_pair
from services.fusion.paired.one_euro import OneEuroFilter

# RMS speed of a busy hand, in m/s: how fast the whereabouts of an unseen landmark become uncertain.
SPEED_SIGMA = 0.5
# Rays that miss each other by more of their sigmas are of two things; interpolated views are less
# exact than their pixels.
RESIDUAL_LIMIT = 30.0


@dataclass
class _Held:
    """The last good point of a landmark."""

    time_s: float
    position_m: Array
    covariance_m2: Array


class PairedMethod:
    """`triangulate` and `disparity`; see services.fusion.method.Method."""

    def __init__(
        self, slots: int, cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion
    ) -> None:
        """periods_s (C,) are the frame times of the cameras."""
        self.counts = Counts()
        self.frames_after = FRAMES_AFTER[settings.pairing]
        self._settings = settings
        self._periods_s = periods_s
        self._shape = (slots, len(cameras))
        self._R, self._t = extrinsics(cameras)
        pairs = {
            (i, j): rectified_pair(cameras[i], cameras[j])
            for i, j in combinations(range(len(cameras)), 2)
        }
        self._pairs: dict[tuple[int, int], RectifiedPair] = {
            key: pair for key, pair in pairs.items() if pair is not None
        }
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        slots, cameras = self._shape
        euro = self._settings.one_euro
        self._tracks = [[RayTrack() for _ in range(cameras)] for _ in range(slots)]
        self._filters = [
            OneEuroFilter(euro.mincutoff_hz, euro.beta, euro.dcutoff_hz, joint=True)
            for _ in range(slots)
        ]
        self._held: list[_Held | None] = [None] * slots

    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:  # noqa: ARG002 - clocks are taken at their word here
        """Take in one camera's frame."""
        for slot, time_s, ray, sigma in zip(
            view.slots.tolist(), times_s.tolist(), view.rays, view.sigma.tolist(), strict=True
        ):
            self._tracks[slot][view.camera].add(time_s, ray, sigma)
        self.counts.accepted += len(view.slots)

    def estimate(self, time_s: float) -> Estimates:
        """All landmarks at an instant."""
        slots, cameras = self._shape
        found, measured, seen = (
            np.zeros(slots, dtype=bool),
            np.zeros(slots, dtype=bool),
            np.zeros(self._shape, dtype=bool),
        )
        positions, covariances = np.zeros((slots, 3)), np.zeros((slots, 3, 3))
        for slot in range(slots):
            rays = {
                c: ray for c in range(cameras) if (ray := self._ray(slot, c, time_s)) is not None
            }
            seen[slot, list(rays)] = True
            if len(rays) >= 2:
                point = self._locate(rays)
                measured[slot] = (
                    point.status is TriangulationStatus.OK
                    and point.residual_sigma <= RESIDUAL_LIMIT
                )
                if measured[slot]:
                    self._take(slot, time_s, point)
                else:
                    self.counts.refused += 1
            held = self._hold(slot, time_s)
            if held is not None:
                found[slot] = True
                age_s = time_s - held.time_s
                positions[slot], covariances[slot] = (
                    held.position_m,
                    held.covariance_m2 + (SPEED_SIGMA * age_s) ** 2 * np.eye(3),
                )
        return Estimates(found, positions, covariances, seen, measured, seen.sum(axis=1) >= 2)

    def _ray(self, slot: int, camera: int, time_s: float) -> Ray | None:
        return self._tracks[slot][camera].at(
            time_s, self._settings.pairing, float(self._periods_s[camera])
        )

    def _locate(self, rays: dict[int, Ray]) -> Triangulation:
        chosen = list(rays)
        if self._settings.method == "disparity":
            pair = next((pair for pair in self._pairs if pair[0] in rays and pair[1] in rays), None)
            if pair is None:
                return Triangulation(
                    TriangulationStatus.PARALLEL, np.zeros(3), np.zeros((3, 3)), float("inf")
                )
            both, sigmas = (
                np.array([rays[c].ray for c in pair]),
                np.array([rays[c].sigma for c in pair]),
            )
            law = depth_law(self._settings.disparity, self._pairs[pair])
            return locate(self._pairs[pair], both, sigmas, law, self._settings.max_distance_m)
        all_rays, sigmas = (
            np.array([ray.ray for ray in rays.values()]),
            np.array([ray.sigma for ray in rays.values()]),
        )
        return triangulate(
            all_rays, sigmas, self._R[chosen], self._t[chosen], self._settings.max_distance_m
        )

    def _take(self, slot: int, time_s: float, point: Triangulation) -> None:
        """Filter a good point and keep it."""
        held = self._held[slot]
        if held is None:
            self._filters[slot].reset()
            self.counts.started += 1
        position = point.position_m
        if self._settings.filter == "one_euro":
            position = self._filters[slot](position, 0.0 if held is None else time_s - held.time_s)
        self._held[slot] = _Held(time_s, position, point.covariance_m2)

    def _hold(self, slot: int, time_s: float) -> _Held | None:
        """The landmark's last good point, unless it is older than hold_s."""
        held = self._held[slot]
        if held is not None and time_s - held.time_s > self._settings.hold_s:
            held = self._held[slot] = None
            self.counts.dropped += 1
        return held
