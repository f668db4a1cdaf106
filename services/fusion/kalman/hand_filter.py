"""One hand's filter: frames in, landmarks begun, restarted and dropped; estimates out."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Packed
from services.fusion.arrays import Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.filtering import oldest_with
from services.fusion.kalman.frame_update import (
    LATE,
    RESTART_WINDOW_S,
    UNUSUAL,
    FrameLooks,
    no_fates,
    no_sights,
)
from services.fusion.kalman.held import (
    HELD,
    Held,
    complete,
    filter_again,
    take_looks,
    tell_all,
)
from services.fusion.kalman.history import empty_history, nodes_of
from services.fusion.kalman.motion.motion_models import MotionModels
from services.fusion.kalman.starting import Looks, fit_start
from services.fusion.method import Counts

# From a resting hand to sharp turns. Chosen on the tuning half of points, as whole sets, before own
# motion was bounded (own_motion.MOST). Geometric mean of RMS, 95 % and maximum at lag 0, over those
# of a filter of each landmark with eight models: .74; with jerk along the way in the last model
# alone .86; with two models more beside the fourth .74; without the fifth .75.
#
# Places wander in most models: skin, tremor and fingers are livelier than white jerk that is
# smoothed over some frames. Tuning half of points, beyond three sigmas at lags 0, 1 and 2 of 22,449
# points: while only a hand at rest did 231, 266 and 330, now 137, 169 and 194, and RMS is none the
# worse (the noise of own motion was mended between). From 7e-8 in the second and third models on
# four cameras' sigmas are too large, with 1e-5 in the fifth a hand that jumps is found late, and
# with 3e-7 in the fourth flapping hands are beyond five sigmas more often (tests of fusion).
_SLOWING = 1.0 / 0.3
MODELS = MotionModels(
    velocity_rate=np.array([0.5, 0.0, 0.0, 2.9, 12.0, 15.0]),
    acceleration_rate=np.array([_SLOWING, _SLOWING, _SLOWING, 3.1, 30.0, 40.0]),
    shift=np.array([0.003, 3.0, 30.0, 300.0, 3e4, 3e3]),
    turn=np.array([0.03, 30.0, 300.0, 3000.0, 1e6, 3e4]),
    along=np.array([0.0, 10.0, 300.0, 3000.0, 0.0, 1e5]),
    own=np.array([1e-9, 0.5, 1.0, 20.0, 3e4, 20.0]),
    walk=np.array([1e-7, 5e-8, 5e-8, 1e-7, 0.0, 1e-5]),
)
# Innovations beyond this squared Mahalanobis distance (2 degrees of freedom) are taken for another
# marker: chance exceeds 30 once in three million.
GATE = 30.0
# Looks of so many frames of the slowest camera begin a landmark, and of so long at least.
START_FRAMES, START_WINDOW_S = 1.4, 0.05
# The next look, if it comes within so many frames, fits the motion that a hand's landmarks began
# with anew. Rays of the first two meet decimetres off where the hand moves, and looks that are
# linearised there bend what follows. Hands that come back into view (tuning half of points, all
# markers gone for .3 s), in the first .1 s, two frames of lag: RMS 1.57 -> 1.01 mm, NEES 19 -> 1.1.
# With later looks as well, hands that flap are up to .1 m off for some frames: they turn round
# meanwhile.
NEXT_FRAMES = 1.6
# Looks that miss a motion by more sigmas than this are of two things.
START_RESIDUAL = 4.0
# Looks that contradict a landmark within RESTART_WINDOW_S, after which it may begin again.
CONTRADICTIONS = 2


class HandFilter:
    """The landmarks (N,) of one hand, by their index in it."""

    def __init__(
        self,
        landmarks: int,
        cameras: Extrinsics,
        hold_s: Array,
        max_distance_m: float,
        counts: Counts,
        frames_per_s: float,
        periods_s: Array,
    ) -> None:
        """hold_s (1,): so long a landmark stays that nobody sees, which others keep up to date.

        frames_per_s: of all cameras, at most; periods_s (C,): their frame times, of FramePace.
        """
        self._cameras = cameras
        self._max_distance_m = max_distance_m
        self._counts = counts
        nodes = nodes_of(frames_per_s)
        self._history = empty_history(landmarks, len(MODELS.own), nodes, len(cameras.t))
        self._sights = no_sights(landmarks, len(cameras.t), hold_s)
        self._fates = no_fates(landmarks)
        held = Held(self._history, self._sights, self._fates, cameras, MODELS, GATE)
        self._held = HELD.pack(held)
        self._periods_s = periods_s
        # Landmarks that began with their last look: the instant of the frame they began at.
        self._young: dict[int, float] = {}

    def observe(self, looks: FrameLooks) -> None:
        """Take in a frame's looks."""
        outcome = take_looks(self._held.address, *looks)
        lost, used, alive = self._fates.counts.tolist()
        self._counts.dropped += lost
        if outcome == LATE:
            self._counts.late += len(looks.landmarks)
            return
        self._counts.accepted += used
        self._counts.gated += alive - used
        if self._young:
            self._fit_young(looks)
        if outcome == UNUSUAL:
            self._begin_where_due(looks)

    def settle(self) -> None:
        """Do what of the last frame points do not wait for; observe() does it where nobody has."""
        if self._history.incomplete[0]:
            complete(self._held.address)

    def _begin_where_due(self, looks: FrameLooks) -> None:
        """Landmarks of a frame that begin, or begin again, as their fates say."""
        fates, time_s = self._fates, float(looks.times_s.mean())
        begin_s = max(START_WINDOW_S, START_FRAMES * float(self._periods_s.max()))
        back, alive, used = fates.back.copy(), fates.alive.copy(), fates.used.copy()
        # Where other landmarks of a hand are known, they tell how a new one moves.
        of_new_hand = not (alive & ~back).any()
        for landmark in looks.landmarks[fates.astray[looks.landmarks]].tolist():
            self._begin(landmark, time_s, RESTART_WINDOW_S)
        for landmark in looks.landmarks[(back | ~alive)[looks.landmarks]].tolist():
            if self._begin(landmark, time_s, begin_s) and of_new_hand:
                first = oldest_with(self._history, landmark, time_s - begin_s)[0]
                self._young[landmark] = float(self._history.time_s[self._history.order[first]])
        for landmark in looks.landmarks[(alive & ~used)[looks.landmarks]].tolist():
            self._begin_again(landmark, time_s)

    def _fit_young(self, looks: FrameLooks) -> None:
        """Fit the motions that young landmarks began with to one look more."""
        history, earliest = self._history, int(self._history.size[0])
        now_s, next_s = float(looks.times_s.mean()), NEXT_FRAMES * float(self._periods_s.mean())
        for landmark in [k for k in looks.landmarks.tolist() if k in self._young]:
            began_s = self._young.pop(landmark)
            indices = oldest_with(history, landmark, began_s - 1e-6)
            node = history.order[indices[0]]
            if now_s - began_s > next_s or not history.begins[node, landmark]:
                continue
            motion = self._fitted(landmark, indices)
            if motion is not None:
                history.motion[node, landmark] = motion
                earliest = min(earliest, int(indices[0]))
        if earliest < history.size[0]:
            filter_again(self._held.address, earliest)

    def _fitted(self, landmark: int, indices: Ints) -> Array | None:
        """The motion (9,) of a landmark at the first of some nodes; None if its looks disagree."""
        looks = self._looks(landmark, indices)
        start = fit_start(looks, self._cameras, self._max_distance_m, self._velocity(landmark))
        if start is None or start.residual > START_RESIDUAL:
            return None
        # From the first look's instant to its node's.
        back_s = -self._history.delay_s[self._history.order[indices[0]], landmark]
        motion = start.motion.copy()
        motion[:3] += back_s * motion[3:6]
        return motion

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
        if len(np.unique(history.camera[history.order[indices]])) < 2:
            return False
        motion = self._fitted(landmark, indices)
        if motion is None:
            self._counts.refused += 1
            return False
        index = int(indices[0])
        node = history.order[index]
        history.motion[node, landmark] = motion
        since = history.order[index : history.size[0]]
        before = history.begins[since, landmark], history.ends[since, landmark]
        history.begins[since, landmark] = since == node
        history.ends[since, landmark] = False
        filter_again(self._held.address, index)
        if not self._has_depth(landmark, indices):
            history.begins[since, landmark], history.ends[since, landmark] = before
            filter_again(self._held.address, index)
            self._counts.refused += 1
            return False
        for k in indices.tolist():
            at = history.order[k]
            if history.used[at, landmark]:
                camera = int(history.camera[at])
                accepted_s = self._sights.accepted_s
                seen_s = float(history.time_s[at] + history.delay_s[at, landmark])
                accepted_s[landmark, camera] = max(float(accepted_s[landmark, camera]), seen_s)
        self._counts.started += 1
        self._sights.begun_s[landmark] = now_s
        return True

    def _has_depth(self, landmark: int, indices: Ints) -> bool:
        """Whether the filter took looks of two cameras, of what a landmark has begun with.

        Of the second one more than one, where it has more: a single one tells where the landmark
        was, not how it moves along the other's ray. (A finger that tapped was 210 mm off so.)
        """
        history = self._history
        nodes = history.order[indices]
        taken, offered = (
            np.bincount(history.camera[nodes[which]], minlength=len(self._cameras.t))
            for which in (history.used[nodes, landmark], np.ones(len(nodes), dtype=bool))
        )
        second = np.argsort(offered)[-2]
        return bool(taken[second] >= min(offered[second], 2))

    def _velocity(self, landmark: int) -> Array:
        """What others of the hand move by on average (3,), if the newest frame's looks fit two.

        Else 0: where a hand seems to jump, what the filter has of its motion is worth nothing.
        """
        history = self._history
        newest = history.order[history.size[0] - 1]
        others = history.used[newest] & history.alive[newest] & history.looked[newest]
        others[landmark] = False
        if np.count_nonzero(others) < 2:
            return np.zeros(3)
        likeliest = int(np.argmax(history.probability[newest]))
        axes = 3 * len(others)
        velocities = history.state[newest, likeliest, axes : 2 * axes].reshape(-1, 3)
        mean: Array = velocities[others].mean(axis=0)
        return mean

    def _begin_again(self, landmark: int, now_s: float) -> None:
        """Begin a landmark again that its latest looks contradict, if those agree."""
        history = self._history
        indices = oldest_with(history, landmark, now_s - RESTART_WINDOW_S)
        nodes = history.order[indices]
        if np.count_nonzero(~history.used[nodes, landmark]) >= CONTRADICTIONS:
            self._begin(landmark, now_s, RESTART_WINDOW_S)

    def tell(self, time_s: float, recent_s: Array, told: Packed) -> bool:
        """Fill told, ESTIMATES, with what is known at an instant.

        Lost landmarks end (frame_update.drop_lost).
        recent_s (C,): so old a camera's look may be to count as of that instant. Returns whether
        there is any landmark that no two cameras see.
        """
        lost, alone = tell_all(self._held.address, told.address, time_s, recent_s)
        self._counts.dropped += lost
        return bool(alone)
