"""The asynchronous estimator: every camera's observation of a landmark counts at its own instant,
paired with nothing.

Each landmark is a track in the ring (ring.py): extended Kalman filters over position, velocity and
acceleration. A track begins where the rays of two cameras meet; observations that contradict it are
gated by their innovation; one that a single camera sees is carried on with growing sigma as
`predicted`, and dropped when no second camera has seen it for hold_s. Views may come from 2..N
cameras in any order; late ones are put in their place as long as the ring reaches back. Landmarks
of a hand at rest share its motion (rest.py).
"""

from __future__ import annotations

import numpy as np

from rhot.files.config import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.triangulation import TriangulationStatus, extrinsics, triangulate
from services.fusion.intake.observations import View
from services.fusion.kalman.frame_update import NO_TRACK, drop, no_looks, take_in
from services.fusion.kalman.rest_detection import blend
from services.fusion.kalman.rigid_body import empty_rest
from services.fusion.kalman.track_history import ACCEPTED, GATED, LATE, empty_ring, query_all, start
from services.fusion.method import Counts, Estimates, Ints

# Jerk densities (m^2/s^5) of the models from a resting hand to a fast finger. Squared error over
# variance stays within .82 and 1.19 for synthetic hands at 0, .02, .1, .5 and 1 m/s and lags of 0
# to 2 frames; with 1, 30, 300, 5000 it is .79 to 1.25 and rendered hands with two frames of lag are
# 2 % worse; with four models (.01, 3, 100, 5000) .72 to 1.11, with a top of 1500 errors at 1 m/s
# are 30 % larger. Without the first, a still hand is 1.6 times as restless, and nothing moving
# gains.
DENSITIES = np.array([0.01, 0.3, 10.0, 80.0, 3000.0])
# Innovations beyond this (2 degrees of freedom) are taken for another marker: chance exceeds 30
# once in three million.
GATE = 30.0
# A new track knows nothing of its motion: sigmas of position about where two rays meet (m), speed
# (m/s), acceleration (m/s^2) of a hand.
START_SIGMAS = np.array([0.3, 1.0, 10.0])
# Rays of two cameras this far apart in time may begin a track; longer than a frame at 30 fps, so
# that a lost one does not matter.
START_WINDOW_S = 0.05
# Rays that miss each other by more sigmas than this, motion in between allowed for, are of two
# things.
START_RESIDUAL = 4.0
# A point this uncertain is of no use to anybody (the width of a hand); a track that young is not
# shown yet.
SHOW_SIGMA_M = 0.05
# A camera counts as seeing a landmark if its last look is not older than this many frames: one
# frame, and jitter.
SEEN_FRAMES = 1.6


class KalmanMethod:
    """All landmarks of all hands of a rig; see services.fusion.method.Method."""

    frames_after = 0

    def __init__(
        self, hands: list[Ints], cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion
    ) -> None:
        """hands: the indices of each hand's landmarks.

        periods_s (C,) are the frame times of the cameras.
        """
        self.counts = Counts()
        self._hands = hands
        self._R, self._t = extrinsics(cameras)
        self._periods_s = periods_s
        self._hold_s = max(settings.hold_s, SEEN_FRAMES * float(periods_s.max()))
        self._reach_m = settings.max_distance_m
        self._shape = (sum(map(len, hands)), len(cameras))
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        slots = self._shape[0]
        self._ring = empty_ring(slots, len(DENSITIES))
        self._rest = empty_rest(self._hands)
        self._looks = no_looks(*self._shape)

    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:
        """Take in one camera's frame."""
        if len(view.slots) == 0:
            return
        self._drop(float(times_s.max()))
        codes = self._take_in(
            view.slots, times_s, view.camera, view.rays, view.sigma, clock_sigma_s, GATE
        )
        accepted, gated, late, new = (
            codes.count(code) for code in (ACCEPTED, GATED, LATE, NO_TRACK)
        )
        self.counts.accepted += accepted
        self.counts.gated += gated
        self.counts.late += late
        self.counts.refused += len(codes) - accepted - gated - late - new
        if new:
            for slot, code, time_s in zip(
                view.slots.tolist(), codes, times_s.tolist(), strict=True
            ):
                if code == NO_TRACK:
                    self._start(slot, time_s, clock_sigma_s)

    def _take_in(
        self,
        slots: Ints,
        times_s: Array,
        camera: int,
        rays: Array,
        sigmas: Array,
        clock_sigma_s: float,
        gate: float,
        *,
        fresh: bool = True,
    ) -> list[int]:
        ring, rest, looks = self._ring, self._rest, self._looks
        codes: Ints = take_in(
            ring,
            rest,
            looks,
            slots,
            times_s,
            camera,
            rays,
            sigmas,
            clock_sigma_s,
            gate,
            self._R,
            self._t,
            DENSITIES,
            fresh,
        )
        return codes.tolist()

    def _start(self, slot: int, now_s: float, clock_sigma_s: float) -> None:
        """Begin a track from the looks of the cameras nearest to an instant, if their rays meet."""
        apart_s = np.abs(self._looks.look_s[slot] - now_s)
        nearest = apart_s.argmin(axis=1)
        cameras = np.flatnonzero(apart_s.min(axis=1) <= START_WINDOW_S)
        if len(cameras) < 2:
            return
        cameras = cameras[
            np.argsort(self._looks.look_s[slot, cameras, nearest[cameras]], kind="stable")
        ]
        times_s, looks = (
            kept[slot, cameras, nearest[cameras]] for kept in (self._looks.look_s, self._looks.look)
        )
        # At half a metre a hand of START_SIGMAS' speed moves this far in the picture between the
        # looks.
        moved = START_SIGMAS[1] * (np.ptp(times_s) + clock_sigma_s) / 0.5
        met = triangulate(
            looks[:, :2],
            np.hypot(looks[:, 2], moved),
            self._R[cameras],
            self._t[cameras],
            self._reach_m,
        )
        if met.status is not TriangulationStatus.OK or met.residual_sigma > START_RESIDUAL:
            self.counts.refused += 1
            return
        start(self._ring, slot, times_s[0], met.position_m, START_SIGMAS)
        self._looks.seen_s[slot] = -np.inf
        for c, time_s, look in zip(cameras.tolist(), times_s, looks, strict=True):
            ray, sigma = look[None, :2].copy(), look[2:].copy()
            self._take_in(
                np.array([slot]),
                np.array([time_s]),
                c,
                ray,
                sigma,
                clock_sigma_s,
                np.inf,
                fresh=False,
            )
        self.counts.started += 1

    def _drop(self, now_s: float) -> None:
        """End the tracks that no two cameras have seen for hold_s."""
        self.counts.dropped += drop(
            self._ring.filled, self._rest.belief, self._looks.seen_s, now_s - self._hold_s
        )

    def estimate(self, time_s: float) -> Estimates:
        """All landmarks at an instant."""
        self._drop(time_s)
        slots = self._shape[0]
        means, covs = np.zeros((slots, 6)), np.zeros((slots, 6, 6))
        found = query_all(self._ring, time_s, DENSITIES, means, covs)
        blend(self._rest, time_s, found, means, covs)
        largest = np.sqrt(covs[:, [0, 1, 2], [0, 1, 2]].max(axis=1))
        found &= np.isfinite(means).all(axis=1) & (largest > 0.0) & (largest <= SHOW_SIGMA_M)
        seen, looked = (
            time_s - last_s <= SEEN_FRAMES * self._periods_s
            for last_s in (self._looks.seen_s, self._looks.looked_s)
        )
        return Estimates(
            found,
            means[:, :3],
            covs[:, :3, :3],
            seen,
            seen.sum(axis=1) >= 2,
            looked.sum(axis=1) >= 2,
        )

    def rest_beliefs(self) -> Array:
        """How likely each landmark (S,) rests in its hand, 0 to 1; rest.py."""
        return self._rest.belief.copy()
