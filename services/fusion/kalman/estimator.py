"""The Kalman method: all landmarks of a hand in one filter, so that each tells of the others.

Every camera's observation counts at its own instant, unpaired, and views may come from 2..N cameras
in any order. See services.fusion.method.Method for what it offers, motion_models.py for the motion
that landmarks share, own_motion.py for what each does by itself.
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
from services.fusion.method import Counts, Estimates
from services.fusion.one_camera.kept_shape import empty_memory, learn_deformation
from services.fusion.one_camera.last_located import LastLocated

# A point this uncertain is of no use to anybody (the width of a hand).
SHOW_SIGMA_M = 0.05
# A camera counts as seeing a landmark if its last observation is not older than this many frames:
# one frame, and jitter.
SEEN_FRAMES = 1.6


class KalmanMethod:
    """All landmarks of all hands of a rig, a filter for each hand."""

    frames_after = 0

    def __init__(
        self, hands: list[Ints], cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion
    ) -> None:
        """hands: the indices of each hand's landmarks; periods_s (C,): the cameras' frame times."""
        self.counts = Counts()
        self._rows = hands
        self._cameras = extrinsics(cameras)
        self._centres_rig = np.array([camera.centre_rig for camera in cameras])  # (C, 3)
        self._hand = np.zeros(sum(map(len, hands)), dtype=np.int64)  # (L,)
        for number, rows in enumerate(hands):
            self._hand[rows] = number
        self._periods_s = periods_s
        self._hold_s = max(settings.hold_s, SEEN_FRAMES * float(periods_s.max()))
        self._max_distance_m = settings.max_distance_m
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        self._located = LastLocated(self._hand)
        self._shape = empty_memory(self._hand.size, self._centres_rig.mean(axis=0))
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
                    FrameLooks(
                        view.camera,
                        at[of_hand],
                        times_s[of_hand],
                        view.rays[of_hand],
                        view.sigmas[of_hand] ** 2,
                        clock_sigma_s**2,
                    )
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
            seen_by[rows] = time_s - hand.sights.accepted_s <= since_s
            detected_by[rows] = time_s - hand.sights.observed_s <= since_s
        measured = seen_by.sum(axis=1) >= 2
        self._tell_alone(time_s, found, seen_by, (places, covs))
        return Estimates(
            found=found & _of_use(places, covs, measured),
            positions_m=places,
            covariances_m2=covs,
            seen_by=seen_by,
            measured=measured,
            detected=detected_by.sum(axis=1) >= 2,
        )

    def _tell_alone(
        self, time_s: float, found: Bools, seen_by: Bools, told: tuple[Array, Array]
    ) -> None:
        """What one camera sees alone, by where two saw it last; told (L, 3), (L, 3, 3) in place."""
        cameras = seen_by.sum(axis=1)
        located, alone = found & (cameras >= 2), found & (cameras == 1)
        self._located.note(located, *told, time_s)
        span_s = float(self._periods_s.min())
        learn_deformation(self._shape, self._hand, located, told[0], time_s, span_s)
        if alone.any():
            centres = self._centres_rig[seen_by.argmax(axis=1)]  # (L, 3)
            self._located.tell(time_s, (alone, located), centres, (self._shape, span_s), told)


@njit(cache=True, error_model="numpy")
def _of_use(places: Array, covs: Array, measured: Bools) -> Bools:
    """Which points (L, 3), (L, 3, 3) are finite and certain enough to be told (L,).

    What one camera sees (not measured, (L,)) may be unsure along its ray: bones tell the solver the
    rest.
    """
    of_use = np.zeros(measured.shape[0], dtype=np.bool_)
    for row in range(measured.shape[0]):
        if not (np.isfinite(places[row]).all() and np.isfinite(covs[row]).all()):
            continue
        variances = np.linalg.eigvalsh(covs[row])  # (3,) ascending
        largest = variances[2] if measured[row] else variances[1]
        of_use[row] = variances[2] > 0.0 and largest <= SHOW_SIGMA_M**2
    return of_use
