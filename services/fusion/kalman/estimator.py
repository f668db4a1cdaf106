"""The Kalman method: all landmarks of a hand in one filter, so that each tells of the others.

Every camera's observation counts at its own instant, unpaired, and views may come from 2..N cameras
in any order. See services.fusion.method.Method for what it offers, motion/ for the motion
that landmarks share and for what each does by itself.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.files.rig_tables import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.observations import View
from services.fusion.kalman.frame_update import FrameLooks
from services.fusion.kalman.hand_filter import HandFilter
from services.fusion.kalman.held import ESTIMATES
from services.fusion.method import Counts, Estimates, no_estimates
from services.fusion.one_camera.last_located import LastLocated

# A point this uncertain is of no use to anybody (the width of a hand).
SHOW_SIGMA_M = 0.05
# A camera counts as seeing a landmark if its last observation is not older than this many frames:
# one frame, and jitter.
SEEN_FRAMES = 1.6
# A landmark that nobody sees is held for so many frames of the slowest camera at least: for as long
# as `hold_s` is at 30 a second. (Tuning motions, 10 frames a second and 30 of which 60 % are lost:
# RMS at two frames 4.5 and 7.6 mm while it was 1.6, 3.1 and 2.6 with it.)
HOLD_FRAMES = 4.5


class KalmanMethod:
    """All landmarks of all hands of a rig, a filter for each hand."""

    frames_after = 0

    def __init__(
        self, hands: list[Ints], cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion
    ) -> None:
        """hands: the indices of each hand's landmarks; periods_s (C,): of FramePace."""
        self.counts = Counts()
        # Landmarks of a hand follow one another.
        self._rows = [slice(int(rows[0]), int(rows[-1]) + 1) for rows in hands]
        self._cameras = extrinsics(cameras)
        self._centres_rig = np.array([camera.centre_rig for camera in cameras])  # (C, 3)
        self._hand = np.zeros(sum(map(len, hands)), dtype=np.int64)  # (L,)
        for number, rows in enumerate(hands):
            self._hand[rows] = number
        self._periods_s, self._least_hold_s = periods_s, settings.hold_s
        self._hold_s = np.empty(1)
        self._note_pace()
        self._span_s = float(periods_s.min())
        self._frames_per_s = float((1.0 / periods_s).sum())
        self._max_distance_m = settings.max_distance_m
        self._told = no_estimates(len(self._hand), len(cameras))
        self._told_of = [ESTIMATES.pack(self._told.of(rows)) for rows in self._rows]
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        eye_rig = self._centres_rig.mean(axis=0)
        self._located = LastLocated(self._hand, eye_rig, self._span_s)
        self._hands = [
            HandFilter(
                rows.stop - rows.start,
                self._cameras,
                self._hold_s,
                self._max_distance_m,
                self.counts,
                self._frames_per_s,
                self._periods_s,
            )
            for rows in self._rows
        ]

    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:
        """Take in one camera's frame."""
        self._note_pace()
        looks = FrameLooks(
            view.camera, view.landmarks, times_s, view.rays, view.sigmas, clock_sigma_s**2
        )
        for rows, hand in zip(self._rows, self._hands, strict=True):
            mine = looks if len(self._hands) == 1 else _looks_at(looks, rows)
            if len(mine.landmarks):
                hand.observe(mine)

    def _note_pace(self) -> None:
        """Landmarks are held by how far apart frames come now."""
        self._hold_s[0] = max(self._least_hold_s, HOLD_FRAMES * float(self._periods_s.max()))

    def estimate(self, time_s: float) -> Estimates:
        """All landmarks at an instant."""
        self._located.settle()
        told, alone, recent_s = self._told, False, SEEN_FRAMES * self._periods_s
        for hand, mine in zip(self._hands, self._told_of, strict=True):
            alone |= hand.tell(time_s, recent_s, mine)
        self._located.take(time_s, told)
        if alone:
            self._located.tell_alone(time_s, self._centres_rig, told)
        alone_with = self._located.alone_with
        _keep_useful(told.found, told.positions_m, told.covariances_m2, told.measured, alone_with)
        return told

    def settle(self) -> None:
        """Learn from the last estimates, and from the last frame what they did not wait for."""
        for hand in self._hands:
            hand.settle()
        self._located.settle()


def _looks_at(looks: FrameLooks, rows: slice) -> FrameLooks:
    """Those of a rig's looks that are at one hand's landmarks, by their index in it."""
    mine = (rows.start <= looks.landmarks) & (looks.landmarks < rows.stop)
    return looks._replace(
        landmarks=looks.landmarks[mine] - rows.start,
        times_s=looks.times_s[mine],
        rays=looks.rays[mine],
        sigmas=looks.sigmas[mine],
    )


@njit(cache=True, error_model="numpy")
def _keep_useful(
    found: Bools, places: Array, covs: Array, measured: Bools, alone_with: Ints
) -> None:
    """Those found (L,), in place, that are finite and certain enough to be told: (L, 3), (L, 3, 3).

    What one camera sees alone (LastLocated.alone_with (L,), not measured) may be unsure along its
    ray: bones tell the solver the rest.
    """
    for row in range(found.size):
        if not (np.isfinite(places[row]).all() and np.isfinite(covs[row]).all()):
            found[row] = False
            continue
        # No variance is larger than all of them together.
        if 0.0 < covs[row, 0, 0] + covs[row, 1, 1] + covs[row, 2, 2] <= SHOW_SIGMA_M**2:
            continue
        variances = np.linalg.eigvalsh(covs[row])  # (3,) ascending
        alone = not measured[row] and alone_with[row] >= 0
        largest = variances[1] if alone else variances[2]
        found[row] &= variances[2] > 0.0 and largest <= SHOW_SIGMA_M**2
