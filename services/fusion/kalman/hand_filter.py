"""One hand's filter: frames in, landmarks begun, restarted and dropped; estimates out."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.filtering import filter_from, insert_frame, oldest_with
from services.fusion.kalman.history import empty_history, start_history
from services.fusion.kalman.motion_models import MotionModels
from services.fusion.kalman.smoother import smooth_hand
from services.fusion.kalman.starting import Looks, fit_start
from services.fusion.method import Counts

# From a resting hand to sharp turns. Chosen on the tuning half of points, as whole sets: with jerk
# along the hand's way in all models but the last one, geometric mean of RMS, 95 % and maximum at
# lag 0 .74 of those of a filter of each landmark with eight models, without it .87; two models
# more, between the fourth and the last, change nothing (.74), and fewer lose 3 % at lag 2.
_SLOWING = 1.0 / 0.3
MODELS = MotionModels(
    velocity_rate=np.array([0.5, 0.0, 0.0, 2.9, 12.0, 15.0]),
    acceleration_rate=np.array([_SLOWING, _SLOWING, _SLOWING, 3.1, 30.0, 40.0]),
    shift=np.array([0.003, 3.0, 30.0, 300.0, 3e4, 3e3]),
    turn=np.array([0.03, 30.0, 300.0, 3000.0, 1e6, 3e4]),
    along=np.array([0.0, 10.0, 300.0, 3000.0, 0.0, 1e5]),
    own=np.array([1e-9, 0.5, 1.0, 20.0, 3e4, 20.0]),
    walk=np.array([1e-7, 0.0, 0.0, 0.0, 0.0, 0.0]),
)
# Innovations beyond this squared Mahalanobis distance (2 degrees of freedom) are taken for another
# marker: chance exceeds 30 once in three million.
GATE = 30.0
# Looks of this long begin a landmark, or begin it again.
START_WINDOW_S = 0.05
RESTART_WINDOW_S = 0.1
# Looks that miss a motion by more sigmas than this are of two things.
START_RESIDUAL = 4.0
# Looks that contradict a landmark within RESTART_WINDOW_S, after which it may begin again.
CONTRADICTIONS = 2
# A landmark that two cameras see and whose sigma is above both, absolutely and against the median
# of its hand, begins again with no fewer looks: from any number, with a fifth of the markers
# missing, it began up to 437 mm off.
ASTRAY_SIGMA_M, ASTRAY_RATIO, ASTRAY_LOOKS = 0.01, 3.0, 6
# What one camera alone has seen for longer is forgotten: by then its distance says nothing.
ONE_CAMERA_S = 2.0


class HandFilter:
    """The landmarks (N,) of one hand, by their index in it."""

    def __init__(
        self,
        landmarks: int,
        cameras: Extrinsics,
        hold_s: float,
        max_distance_m: float,
        counts: Counts,
    ) -> None:
        self._cameras = cameras
        self._hold_s = hold_s
        self._max_distance_m = max_distance_m
        self._counts = counts
        self._history = empty_history(landmarks, len(MODELS.own))
        shape = (landmarks, len(cameras.t))
        self.accepted_s = np.full(shape, -np.inf)  # (N, C) last observation that was used
        self.observed_s = np.full(shape, -np.inf)  # (N, C) last observation
        self._begun_s = np.full(landmarks, -np.inf)

    def observe(
        self,
        camera: int,
        landmarks: Ints,
        times_s: Array,
        rays: Array,
        variances: Array,
        clock_variance: float,
    ) -> None:
        """Take in a frame's n looks: landmarks (n,), times (n,), rays (n, 2), variances (n,)."""
        time_s = float(times_s.mean())
        self.drop_lost(time_s)
        history = self._history
        if history.size[0] == 0:
            start_history(history, time_s - 1e-6)
        index = insert_frame(history, time_s, camera, clock_variance)
        if index < 0:
            self._counts.late += len(landmarks)
            return
        node = history.order[index]
        history.looked[node] = False
        history.looked[node, landmarks] = True
        history.delay_s[node, landmarks] = times_s - time_s
        history.ray[node, landmarks] = rays
        history.ray_variance[node, landmarks] = variances
        back = self._is_back(landmarks, camera, time_s)
        self._filter_from(index)
        alive, used = history.alive[node, landmarks], history.used[node, landmarks]
        self.observed_s[landmarks, camera] = np.maximum(self.observed_s[landmarks, camera], times_s)
        self._counts.accepted += int(np.count_nonzero(used))
        self._counts.gated += int(np.count_nonzero(alive & ~used))
        self._note_used(landmarks[used], camera, times_s[used])
        for landmark in landmarks[self._astray(landmarks)].tolist():
            if len(oldest_with(history, landmark, time_s - RESTART_WINDOW_S)) >= ASTRAY_LOOKS:
                self._begin(landmark, time_s, RESTART_WINDOW_S)
        for landmark in landmarks[back].tolist():
            self._begin(landmark, time_s, START_WINDOW_S)
        if not used.all():
            for landmark in landmarks[~alive].tolist():
                self._begin(landmark, time_s, START_WINDOW_S)
            for landmark in landmarks[alive & ~used].tolist():
                self._begin_again(landmark, time_s)

    def _alone_since(self, time_s: float) -> Array:
        """How long all but one camera have not seen each landmark (N,), s; 0 if none ever did."""
        second_s = np.partition(self.accepted_s, -2, axis=1)[:, -2]
        return np.asarray(np.where(np.isfinite(second_s), time_s - second_s, 0.0))

    def _is_back(self, landmarks: Ints, camera: int, time_s: float) -> Bools:
        """Which landmarks (n,) another camera saw alone for longer than hold_s.

        They begin anew where rays meet: along that camera's ray only old motion was known.
        """
        last_s = self.accepted_s[landmarks, camera]
        alone = self._alone_since(time_s)[landmarks] > self._hold_s
        return np.asarray(alone & (time_s - last_s > self._hold_s))

    def _astray(self, landmarks: Ints) -> Bools:
        """Which of a newest frame's landmarks (n,) are known much worse than their hand is.

        Two cameras see them, and yet they are adrift along a ray: as each look fits by itself, no
        gate tells.
        """
        history = self._history
        newest = history.order[history.size[0] - 1]
        likeliest = int(np.argmax(history.probability[newest]))
        alive = history.alive[newest]
        variances = history.cov[newest, likeliest].diagonal()[: 3 * len(alive)]
        largest = variances.reshape(-1, 3).max(axis=1)  # (N,)
        usual = float(np.median(largest[alive])) if alive.any() else 0.0
        now_s = float(history.time_s[newest])
        seen_by = np.count_nonzero(self.accepted_s >= now_s - RESTART_WINDOW_S, axis=1)
        wide = largest > max(ASTRAY_SIGMA_M**2, ASTRAY_RATIO**2 * usual)
        settled = now_s - self._begun_s > RESTART_WINDOW_S
        return np.asarray((alive & wide & settled & (seen_by >= 2))[landmarks])

    def _note_used(self, landmarks: Ints, camera: int, times_s: Array) -> None:
        self.accepted_s[landmarks, camera] = np.maximum(self.accepted_s[landmarks, camera], times_s)

    def _filter_from(self, index: int) -> None:
        filter_from(self._history, index, self._cameras, MODELS, GATE)

    def _looks(self, landmark: int, indices: Ints) -> Looks:
        history = self._history
        nodes = history.order[indices]
        return Looks(
            time_s=history.time_s[nodes] + history.delay_s[nodes, landmark],
            camera=history.camera[nodes],
            ray=history.ray[nodes, landmark],
            variance=history.ray_variance[nodes, landmark],
            clock_variance=history.clock_variance[nodes],
        )

    def _begin(self, landmark: int, now_s: float, window_s: float) -> bool:
        """Begin a landmark with its looks of the last window_s, if two cameras' agree."""
        history = self._history
        indices = oldest_with(history, landmark, now_s - window_s)
        looks = self._looks(landmark, indices)
        if len(np.unique(looks.camera)) < 2:
            return False
        start = fit_start(looks, self._cameras, self._max_distance_m, np.zeros(3))
        if start is None or start.residual > START_RESIDUAL:
            self._counts.refused += 1
            return False
        index = int(indices[0])
        node = history.order[index]
        history.begins[node, landmark] = True
        # From the first look's instant to its node's.
        back_s = -history.delay_s[node, landmark]
        motion = start.motion.copy()
        motion[:3] += back_s * motion[3:6]
        history.motion[node, landmark] = motion
        for later in history.order[index : history.size[0]]:
            history.ends[later, landmark] = False
            if later != node:
                history.begins[later, landmark] = False
        self._filter_from(index)
        for k in indices.tolist():
            at = history.order[k]
            if history.used[at, landmark]:
                self._note_used(
                    np.array([landmark]),
                    int(history.camera[at]),
                    history.time_s[at : at + 1] + history.delay_s[at, landmark],
                )
        self._counts.started += 1
        self._begun_s[landmark] = now_s
        return True

    def _begin_again(self, landmark: int, now_s: float) -> None:
        """Begin a landmark again that its latest looks contradict, if those agree."""
        history = self._history
        indices = oldest_with(history, landmark, now_s - RESTART_WINDOW_S)
        nodes = history.order[indices]
        if np.count_nonzero(~history.used[nodes, landmark]) >= CONTRADICTIONS:
            self._begin(landmark, now_s, RESTART_WINDOW_S)

    def drop_lost(self, now_s: float) -> None:
        """End landmarks that no camera has seen for hold_s, or one alone for ONE_CAMERA_S.

        One that a second camera has seen since, but nothing that fits, is lost after hold_s.
        """
        history = self._history
        if history.size[0] == 0:
            return
        newest = history.order[history.size[0] - 1]
        seen = now_s - self.accepted_s.max(axis=1) <= self._hold_s  # (N,)
        shown = np.count_nonzero(self.observed_s >= now_s - self._hold_s, axis=1)
        alone_s = self._alone_since(now_s)
        kept = seen & (alone_s <= np.where(shown >= 2, self._hold_s, ONE_CAMERA_S))
        lost = history.alive[newest] & ~kept
        if lost.any():
            history.ends[newest] |= lost
            self._counts.dropped += int(np.count_nonzero(lost))
            if history.size[0] > 1:
                self._filter_from(int(history.size[0]) - 1)
            else:
                history.alive[newest] &= ~lost

    def estimate(self, time_s: float) -> tuple[Bools, Array, Array]:
        """Which landmarks (N,) there are at an instant, places (N, 3), covs (N, 3, 3)."""
        count = len(self._begun_s)
        places, covs = np.zeros((count, 3)), np.zeros((count, 3, 3))
        if self._history.size[0] == 0:
            return np.zeros(count, dtype=np.bool_), places, covs
        return smooth_hand(self._history, MODELS, time_s, places, covs), places, covs
