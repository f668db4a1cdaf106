"""The joint method: all landmarks of a hand in one filter, so that each tells of the others.

See services.fusion.method.Method for what it offers; motion_models.py for the motion they share.
"""

from __future__ import annotations

import numpy as np

from rhot.files.rig_tables import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.observations import View
from services.fusion.joint.hand_filter import HandFilter
from services.fusion.method import Counts, Estimates

# A point this uncertain is of no use to anybody (the width of a hand).
SHOW_SIGMA_M = 0.05
# A camera counts as seeing a landmark if its last observation is not older than this many frames:
# one frame, and jitter.
SEEN_FRAMES = 1.6


class JointMethod:
    """All landmarks of all hands of a rig, a filter for each hand."""

    frames_after = 0

    def __init__(
        self, hands: list[Ints], cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion
    ) -> None:
        """hands: the indices of each hand's landmarks; periods_s (C,): the cameras' frame times."""
        self.counts = Counts()
        self._rows = hands
        self._cameras = extrinsics(cameras)
        self._periods_s = periods_s
        self._hold_s = max(settings.hold_s, SEEN_FRAMES * float(periods_s.max()))
        self._max_distance_m = settings.max_distance_m
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        self._hands = [
            HandFilter(len(rows), self._cameras, self._hold_s, self._max_distance_m, self.counts)
            for rows in self._rows
        ]

    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:
        """Take in one camera's frame."""
        for rows, hand in zip(self._rows, self._hands, strict=True):
            at = np.searchsorted(rows, view.landmarks)
            at[at == len(rows)] = 0
            of_hand = rows[at] == view.landmarks
            if of_hand.any():
                hand.observe(
                    view.camera,
                    at[of_hand],
                    times_s[of_hand],
                    view.rays[of_hand],
                    view.sigmas[of_hand] ** 2,
                    clock_sigma_s**2,
                )

    def estimate(self, time_s: float) -> Estimates:
        """All landmarks at an instant."""
        landmarks = sum(map(len, self._rows))
        cameras = len(self._periods_s)
        found = np.zeros(landmarks, dtype=np.bool_)
        places, covs = np.zeros((landmarks, 3)), np.zeros((landmarks, 3, 3))
        seen_by = np.zeros((landmarks, cameras), dtype=np.bool_)
        detected_by = np.zeros((landmarks, cameras), dtype=np.bool_)
        since_s = SEEN_FRAMES * self._periods_s  # (C,)
        for rows, hand in zip(self._rows, self._hands, strict=True):
            hand.drop_lost(time_s)
            found[rows], places[rows], covs[rows] = hand.estimate(time_s)
            seen_by[rows] = time_s - hand.accepted_s <= since_s
            detected_by[rows] = time_s - hand.observed_s <= since_s
        return Estimates(
            found=found & _of_use(places, covs),
            positions_m=places,
            covariances_m2=covs,
            seen_by=seen_by,
            measured=seen_by.sum(axis=1) >= 2,
            detected=detected_by.sum(axis=1) >= 2,
        )


def _of_use(places: Array, covs: Array) -> Bools:
    """Which points (L, 3), (L, 3, 3) are finite and certain enough to be told (L,)."""
    largest = np.sqrt(np.maximum(np.einsum("nii->ni", covs).max(axis=1), 0.0))
    finite = np.isfinite(places).all(axis=1)
    return np.asarray(finite & (largest > 0.0) & (largest <= SHOW_SIGMA_M))
