"""The asynchronous estimator: every camera's observation of a landmark counts at its own instant, paired with nothing.

Each landmark is a track in the ring (ring.py): extended Kalman filters over position, velocity and acceleration. A track begins
where the rays of two cameras meet; observations that contradict it are gated by their innovation; one that a single camera sees
is carried on with growing sigma as `predicted`, and dropped when no second camera has seen it for hold_s. Views may come from
2..N cameras in any order; late ones are put in their place as long as the ring reaches back.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rhot.camera import Camera
from rhot.config import Fusion
from rhot.transforms import Array
from services.fusion.method import Counts, Estimates
from services.fusion.observations import View
from services.fusion.ring import ACCEPTED, GATED, LATE, empty_ring, insert_all, query_all, start
from services.fusion.triangulation import TriangulationStatus, extrinsics, triangulate

# Jerk densities (m^2/s^5) of the models from a resting hand to a fast finger. Squared error over variance stays within .82 and 1.19 for
# synthetic hands at 0, .02, .1, .5 and 1 m/s and lags of 0 to 2 frames; with 1, 30, 300, 5000 it is .79 to 1.25 and rendered hands with two
# frames of lag are 2 % worse; with four models (.01, 3, 100, 5000) .72 to 1.11, with a top of 1500 errors at 1 m/s are 30 % larger.
# Without the first, a still hand is 1.6 times as restless, and nothing moving gains.
DENSITIES = np.array([0.01, 0.3, 10.0, 80.0, 3000.0])
# Innovations beyond this (2 degrees of freedom) are taken for another marker: chance exceeds 30 once in three million.
GATE = 30.0
# A new track knows nothing of its motion: sigmas of position about where two rays meet (m), speed (m/s), acceleration (m/s^2) of a hand.
START_SIGMAS = np.array([0.3, 1.0, 10.0])
# Rays of two cameras this far apart in time may begin a track; longer than a frame at 30 fps, so that a lost one does not matter.
START_WINDOW_S = 0.05
# Rays that miss each other by more sigmas than this, motion in between allowed for, are of two things.
START_RESIDUAL = 4.0
# A point this uncertain is of no use to anybody (the width of a hand); a track that young is not shown yet.
SHOW_SIGMA_M = 0.05
# A camera counts as seeing a landmark if its last look is not older than this many frames: one frame, and jitter.
SEEN_FRAMES = 1.6


class KalmanMethod:
    """All landmarks of all hands of a rig; see services.fusion.method.Method."""

    frames_after = 0

    def __init__(self, slots: int, cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion) -> None:
        """periods_s (C,) are the frame times of the cameras."""
        self.counts = Counts()
        self._R, self._t = extrinsics(cameras)
        self._periods_s = periods_s
        self._hold_s = max(settings.hold_s, SEEN_FRAMES * float(periods_s.max()))
        self._reach_m = settings.max_distance_m
        self._shape = (slots, len(cameras))
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        slots = self._shape[0]
        self._ring = empty_ring(slots, len(DENSITIES))
        # Last accepted look of each camera at each landmark, and the last look of all for beginning a track.
        self._seen_s = np.full(self._shape, -np.inf)
        self._look_s = np.full(self._shape, -np.inf)
        self._look = np.zeros((*self._shape, 3))  # ray and sigma

    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:
        """Take in one camera's frame."""
        if len(view.slots) == 0:
            return
        self._drop(float(times_s.max()))
        self._look_s[view.slots, view.camera] = times_s
        self._look[view.slots, view.camera, :2] = view.rays
        self._look[view.slots, view.camera, 2] = view.sigma
        running = self._ring.filled[view.slots] > 0
        for slot in view.slots[~running].tolist():
            self._start(slot, view.camera, clock_sigma_s)
        if running.any():
            self._insert(view, np.flatnonzero(running), times_s, clock_sigma_s)

    def _insert(self, view: View, rows: npt.NDArray[np.intp], times_s: Array, clock_sigma_s: float) -> None:
        slots, times_s = view.slots[rows], times_s[rows]
        variances = np.stack([view.sigma[rows] ** 2, np.full(len(rows), clock_sigma_s**2)], axis=1)
        codes = insert_all(self._ring, slots, times_s, view.camera, view.rays[rows], variances, GATE, self._R, self._t, DENSITIES)
        taken = codes == ACCEPTED
        self._seen_s[slots[taken], view.camera] = np.maximum(self._seen_s[slots[taken], view.camera], times_s[taken])
        accepted, gated, late = (int(np.count_nonzero(codes == code)) for code in (ACCEPTED, GATED, LATE))
        self.counts.accepted += accepted
        self.counts.gated += gated
        self.counts.late += late
        self.counts.refused += len(rows) - accepted - gated - late

    def _start(self, slot: int, camera: int, clock_sigma_s: float) -> None:
        """Begin a track from the newest looks of the cameras, if their rays meet."""
        now_s = self._look_s[slot, camera]
        cameras = np.flatnonzero(np.abs(self._look_s[slot] - now_s) <= START_WINDOW_S)
        if len(cameras) < 2:
            return
        cameras = cameras[np.argsort(self._look_s[slot, cameras], kind="stable")]
        times_s, looks = self._look_s[slot, cameras], self._look[slot, cameras]
        # At half a metre a hand of START_SIGMAS' speed moves this far in the picture between the looks.
        moved = START_SIGMAS[1] * (np.ptp(times_s) + clock_sigma_s) / 0.5
        met = triangulate(looks[:, :2], np.hypot(looks[:, 2], moved), self._R[cameras], self._t[cameras], self._reach_m)
        if met.status is not TriangulationStatus.OK or met.residual_sigma > START_RESIDUAL:
            self.counts.refused += 1
            return
        start(self._ring, slot, times_s[0], met.position_m, START_SIGMAS)
        self._seen_s[slot] = -np.inf
        for c, time_s, look in zip(cameras.tolist(), times_s, looks, strict=True):
            variances = np.array([[look[2] ** 2, clock_sigma_s**2]])
            insert_all(
                self._ring, np.array([slot]), np.array([time_s]), c, look[None, :2].copy(), variances, np.inf, self._R, self._t, DENSITIES
            )
            self._seen_s[slot, c] = time_s
        self.counts.started += 1

    def _drop(self, now_s: float) -> None:
        """End the tracks that no two cameras have seen for hold_s."""
        second_s = np.sort(self._seen_s, axis=1)[:, -2] if self._shape[1] > 1 else np.full(self._shape[0], -np.inf)
        lost = (self._ring.filled > 0) & (now_s - second_s > self._hold_s)
        if lost.any():
            self._ring.filled[lost] = 0
            self.counts.dropped += int(np.count_nonzero(lost))

    def estimate(self, time_s: float) -> Estimates:
        """All landmarks at an instant."""
        self._drop(time_s)
        slots = self._shape[0]
        means, covs = np.zeros((slots, 6)), np.zeros((slots, 6, 6))
        found = query_all(self._ring, time_s, DENSITIES, means, covs)
        largest = np.sqrt(covs[:, [0, 1, 2], [0, 1, 2]].max(axis=1))
        found &= np.isfinite(means).all(axis=1) & (largest > 0.0) & (largest <= SHOW_SIGMA_M)
        seen, looked = (time_s - last_s <= SEEN_FRAMES * self._periods_s for last_s in (self._seen_s, self._look_s))
        return Estimates(found, means[:, :3], covs[:, :3, :3], seen, seen.sum(axis=1) >= 2, looked.sum(axis=1) >= 2)
