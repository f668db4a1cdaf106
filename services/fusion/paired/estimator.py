"""The paired methods: bring the views to one instant, triangulate or apply the depth law, filter.

What a result needs from later frames it waits for (ray_interpolation.FRAMES_AFTER). A landmark
whose views cannot be brought together, or whose rays do not meet, is held where it was as
`predicted`, with a sigma that grows at SPEED_SIGMA, and dropped after hold_s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.files.rig_tables import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import extrinsics
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.geometry.triangulation import (
    Triangulation,
    TriangulationStatus,
    triangulate,
)
from services.fusion.intake.observations import View
from services.fusion.intake.ray_interpolation import FRAMES_AFTER, InterpolatedRay, RayTrack
from services.fusion.method import Counts, Estimates
from services.fusion.paired.depth_law import depth_law, locate
from services.fusion.paired.one_euro import OneEuroFilter

# RMS speed of a busy hand, in m/s: how fast the position of an unseen landmark becomes uncertain.
SPEED_SIGMA = 0.5
# Rays that miss each other by more of their sigmas are of two things; interpolated views are less
# exact than their pixels.
RESIDUAL_LIMIT = 30.0


@dataclass
class _Held:
    """The last good point of a landmark."""

    time_s: float
    position_m: Array  # (3,)
    covariance_m2: Array  # (3, 3)


class PairedMethod:
    """`triangulate` and `disparity`; see services.fusion.method.Method."""

    def __init__(
        self, landmarks: int, cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion
    ) -> None:
        """periods_s (C,) are the frame times of the cameras."""
        self.counts = Counts()
        self.frames_after = FRAMES_AFTER[settings.pairing]
        self._settings = settings
        self._periods_s = periods_s
        self._shape = (landmarks, len(cameras))
        self._extrinsics = extrinsics(cameras)
        self._pairs = rectified_pairs(cameras)
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        landmarks, cameras = self._shape
        euro = self._settings.one_euro
        self._tracks = [[RayTrack() for _ in range(cameras)] for _ in range(landmarks)]
        self._filters = [
            OneEuroFilter(euro.mincutoff_hz, euro.beta, euro.dcutoff_hz, joint=True)
            for _ in range(landmarks)
        ]
        self._held: list[_Held | None] = [None] * landmarks

    # Clocks are taken at their word here.
    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:  # noqa: ARG002
        """Take in one camera's frame."""
        for landmark, time_s, ray, sigma in zip(
            view.landmarks.tolist(), times_s.tolist(), view.rays, view.sigmas.tolist(), strict=True
        ):
            self._tracks[landmark][view.camera].add(time_s, ray, sigma)
        self.counts.accepted += len(view.landmarks)

    def estimate(self, time_s: float) -> Estimates:
        """All landmarks at an instant."""
        landmarks = self._shape[0]
        found = np.zeros(landmarks, dtype=bool)
        measured = np.zeros(landmarks, dtype=bool)
        seen_by = np.zeros(self._shape, dtype=bool)
        positions = np.zeros((landmarks, 3))
        covariances = np.zeros((landmarks, 3, 3))
        for landmark in range(landmarks):
            rays = self._rays(landmark, time_s)
            seen_by[landmark, list(rays)] = True
            if len(rays) >= 2:
                measured[landmark] = self._measure(landmark, time_s, rays)
            held = self._hold(landmark, time_s)
            if held is not None:
                found[landmark] = True
                age_s = time_s - held.time_s
                positions[landmark] = held.position_m
                covariances[landmark] = held.covariance_m2 + (SPEED_SIGMA * age_s) ** 2 * np.eye(3)
        return Estimates(
            found=found,
            positions_m=positions,
            covariances_m2=covariances,
            seen_by=seen_by,
            measured=measured,
            detected=seen_by.sum(axis=1) >= 2,
        )

    def settle(self) -> None:
        """Nothing waits."""

    def _rays(self, landmark: int, time_s: float) -> dict[int, InterpolatedRay]:
        """A landmark's rays at an instant, by the camera; of those that have one."""
        rays = {}
        for camera, track in enumerate(self._tracks[landmark]):
            ray = track.at(time_s, self._settings.pairing, float(self._periods_s[camera]))
            if ray is not None:
                rays[camera] = ray
        return rays

    def _measure(self, landmark: int, time_s: float, rays: dict[int, InterpolatedRay]) -> bool:
        """Locate a landmark and keep it, filtered; False if its rays do not meet."""
        point = self._locate(rays)
        meets = point.status is TriangulationStatus.OK and point.residual_sigma <= RESIDUAL_LIMIT
        if not meets:
            self.counts.refused += 1
            return False
        held = self._held[landmark]
        if held is None:
            self._filters[landmark].reset()
            self.counts.started += 1
        position = point.position_m
        if self._settings.filter == "one_euro":
            dt_s = 0.0 if held is None else time_s - held.time_s
            position = self._filters[landmark](position, dt_s)
        self._held[landmark] = _Held(time_s, position, point.covariance_m2)
        return True

    def _locate(self, rays: dict[int, InterpolatedRay]) -> Triangulation:
        """The point by two or more cameras' rays."""
        settings = self._settings
        if settings.method == "disparity":
            pair = next((pair for pair in self._pairs if pair[0] in rays and pair[1] in rays), None)
            if pair is None:
                return Triangulation(
                    TriangulationStatus.PARALLEL, np.zeros(3), np.zeros((3, 3)), float("inf")
                )
            both, sigmas = _stacked([rays[camera] for camera in pair])
            law = depth_law(settings.disparity, self._pairs[pair])
            return locate(self._pairs[pair], both, sigmas, law, settings.max_distance_m)
        all_rays, sigmas = _stacked(list(rays.values()))
        cameras = self._extrinsics.of(list(rays))
        return triangulate(all_rays, sigmas, cameras, settings.max_distance_m)

    def _hold(self, landmark: int, time_s: float) -> _Held | None:
        """The landmark's last good point, unless it is older than hold_s."""
        held = self._held[landmark]
        if held is not None and time_s - held.time_s > self._settings.hold_s:
            held = self._held[landmark] = None
            self.counts.dropped += 1
        return held


def _stacked(rays: list[InterpolatedRay]) -> tuple[Array, Array]:
    """Rays (n, 2) and their sigmas (n,)."""
    return np.array([ray.ray for ray in rays]), np.array([ray.sigma for ray in rays])
