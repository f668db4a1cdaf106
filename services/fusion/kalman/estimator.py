"""The asynchronous Kalman method: every camera's observation counts at its own instant, unpaired.

Each landmark has a track: extended Kalman filters over position, velocity and acceleration, several
motion models side by side (multiple_models.py). A track starts where the rays of two cameras meet.
Observations that contradict it are gated by their innovation. A track that a single camera sees is
`predicted`: its sigma grows along that camera's ray. It is dropped when no camera has seen it for
hold_s, or when a second one has seen only what contradicts it for so long. Views may come from 2..N
cameras in any order; late ones are inserted as long as the track's history reaches back. Landmarks
of a hand at rest share its motion (rest/).
"""

from __future__ import annotations

import numpy as np

from rhot.files.rig_tables import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import extrinsics
from services.fusion.geometry.triangulation import TriangulationStatus, triangulate
from services.fusion.intake.frame_rays import FrameRays
from services.fusion.intake.observations import View
from services.fusion.kalman.frame_update import (
    NO_TRACK,
    drop_lost_tracks,
    empty_state,
    update_frame,
)
from services.fusion.kalman.motion_model import ACCELERATION_TIME_S
from services.fusion.kalman.one_camera import LastLocated
from services.fusion.kalman.recent_observations import alone_before
from services.fusion.kalman.telling import SEEN_FRAMES, empty_telling, tell
from services.fusion.kalman.track_history import start_track
from services.fusion.kalman.track_insertion import ACCEPTED, GATED, LATE
from services.fusion.method import Counts, Estimates

# The models from a resting hand to a waving one: jerk density (m^2/s^5), how fast velocity and
# acceleration fade (1/s), and the jerk density that is added along the way. Squared error over
# variance stays within .78 and 1.02 for synthetic hands at 0, .02, .1 and .5 m/s and lags of 0 to 2
# frames. Without the first, a still hand is 1.6 times as restless, and nothing moving gains; .5,
# 30, 1500 in the place of .3 to 1500: 11 % worse at .1 m/s. The last two follow sharp turns (a
# recorded wave: .8 m/s RMS, 50 m/s^2 in one instant of twenty). Their velocity fades, or they take
# for depth what one camera sees before the other and run off. The wave at lag 2, RMS and maximum: 5
# and 22 mm; without them 76 and 935; one of 1e5 whose velocity lasts 73 and 1460; of (3e4, 3, 12)
# 31 and 619; of (1e5, 12, 25) 5 and 32, but then stop-and-go at 14 m/s^2 has 29 for 20 mm, and is
# 10 % worse without lag. The one before them is calm across the way that the landmark came (fourth
# column, recent_way.py). 95 % of errors, mm, on tuning motions without it and with it, at lag 0 and
# at lag 2: slow flapping 8.8, 1.8 -> 3.9, .9; fast flapping 16, 5.2 -> 7.2, 1.4; claps 14, 4.8 ->
# 7.9, 3.8; the wave 24, 10 -> 23.5, 9.5; stop and go, taps and a recorded grab as before, or better
# by some per cent.
SLOWING = 1.0 / ACCELERATION_TIME_S
MODELS = np.array(
    [
        [0.01, 0.0, SLOWING, 0.0],
        [0.3, 0.0, SLOWING, 0.0],
        [10.0, 0.0, SLOWING, 0.0],
        [80.0, 0.0, SLOWING, 0.0],
        [1500.0, 0.0, SLOWING, 0.0],
        [100.0, 8.0, 20.0, 2e5],
        [2e4, 8.0, 20.0, 0.0],
        [2e5, 15.0, 40.0, 0.0],
    ]
)
# Innovations beyond this squared Mahalanobis distance (2 degrees of freedom) are taken for another
# marker: chance exceeds 30 once in three million.
GATE = 30.0
# The prior of a new track: sigmas of position about where two rays meet (m), and of a hand's speed
# (m/s) and acceleration (m/s^2), of which nothing is known yet.
START_SIGMAS = np.array([0.3, 1.0, 10.0])
# Rays of two cameras this far apart in time may start a track; longer than a frame at 30 fps, so
# that a lost one does not matter.
START_WINDOW_S = 0.05
# Rays that miss each other by more sigmas than this, motion in between allowed for, are of two
# things.
START_RESIDUAL = 4.0
# A point this uncertain is of no use to anybody (the width of a hand); a track that young is not
# shown yet. Of one that a single camera sees, across its ray: bones tell the solver the rest.
SHOW_SIGMA_M = 0.05


class KalmanMethod:
    """All landmarks of all hands of a rig; see services.fusion.method.Method."""

    frames_after = 0

    def __init__(
        self, hands: list[Ints], cameras: tuple[Camera, ...], periods_s: Array, settings: Fusion
    ) -> None:
        """hands: the indices of each hand's landmarks; periods_s (C,): the cameras' frame times."""
        self.counts = Counts()
        self._hands = hands
        self._extrinsics = extrinsics(cameras)
        self._centres_rig = np.array([camera.centre_rig for camera in cameras])  # (C, 3)
        self._periods_s = periods_s
        self._seen_since_s = SEEN_FRAMES * periods_s  # (C,)
        self._hold_s = max(settings.hold_s, SEEN_FRAMES * float(periods_s.max()))
        self._max_distance_m = settings.max_distance_m
        self.reset()

    def reset(self) -> None:
        """Forget all observations."""
        self._state = empty_state(self._hands, self._centres_rig, len(MODELS))
        self._located = LastLocated(self._state.rest.hand)

    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:
        """Take in one camera's frame."""
        if len(view.landmarks) == 0:
            return
        self._drop(float(times_s.max()))
        frame = FrameRays(
            view.camera, view.landmarks, times_s, view.rays, view.sigmas, clock_sigma_s
        )
        is_back = self._is_back(view, times_s)
        codes = self._update(frame, GATE, new=True)
        accepted, gated, late, new = map(codes.count, (ACCEPTED, GATED, LATE, NO_TRACK))
        self.counts.accepted += accepted
        self.counts.gated += gated
        self.counts.late += late
        self.counts.refused += len(codes) - accepted - gated - late - new
        if accepted == len(codes) and not is_back.any():
            return
        for n, code in enumerate(codes):
            landmark = int(view.landmarks[n])
            contradicted = code == GATED and self._is_contradicted(landmark)
            if code == NO_TRACK or contradicted or is_back[n]:
                self._start(landmark, float(times_s[n]), clock_sigma_s)

    def _is_back(self, view: View, times_s: Array) -> Bools:
        """Which of a view's landmarks (n,) another camera saw alone for longer than hold_s.

        Their tracks start anew where the rays meet: along that camera's ray they only knew the
        velocity of before (one camera gone for .3 s, held out: at most 72 mm off at lag 2
        otherwise).
        """
        recent = self._state.recent
        found: Bools = alone_before(
            recent.accepted_s, view.landmarks, view.camera, times_s, self._hold_s
        )
        return found

    def _is_contradicted(self, landmark: int) -> bool:
        """Whether two cameras see a landmark, and its track has accepted nothing lately.

        One camera alone may see another thing, and one observation of each may be wild: starting
        anew at the second, where rays meet, put hands that stop and go 217 mm off for a moment.
        """
        recent = self._state.recent
        since_s = recent.observed_s[landmark].max() - START_WINDOW_S
        seen_by = np.count_nonzero(recent.observed_s[landmark] >= since_s)
        return bool(seen_by >= 2 and recent.accepted_s[landmark].max() < since_s)

    def _update(self, frame: FrameRays, gate: float, *, new: bool) -> list[int]:
        codes: Ints = update_frame(self._state, frame, self._extrinsics, MODELS, gate, new)
        return codes.tolist()

    def _start(self, landmark: int, now_s: float, clock_sigma_s: float) -> None:
        """Start a track if the rays of two cameras meet: those nearest to an instant."""
        recent = self._state.recent
        apart_s = np.abs(recent.time_s[landmark] - now_s)  # (C, KEPT)
        cameras = np.flatnonzero(apart_s.min(axis=1) <= START_WINDOW_S)
        if len(cameras) < 2:
            return
        nearest = apart_s.argmin(axis=1)
        by_time = np.argsort(recent.time_s[landmark, cameras, nearest[cameras]], kind="stable")
        cameras = cameras[by_time]  # (n,) and so are all of these
        times_s = recent.time_s[landmark, cameras, nearest[cameras]]
        rays = recent.ray[landmark, cameras, nearest[cameras]]  # (n, 2)
        sigmas = recent.sigma[landmark, cameras, nearest[cameras]]
        # At half a metre a hand of START_SIGMAS' speed moves this far in the image between the
        # observations.
        moved = START_SIGMAS[1] * (np.ptp(times_s) + clock_sigma_s) / 0.5
        met = triangulate(
            rays, np.hypot(sigmas, moved), self._extrinsics.of(cameras), self._max_distance_m
        )
        if met.status is not TriangulationStatus.OK or met.residual_sigma > START_RESIDUAL:
            self.counts.refused += 1
            return
        start_track(self._state.history, landmark, times_s[0], met.position_m, START_SIGMAS)
        recent.accepted_s[landmark] = -np.inf
        for n, camera in enumerate(cameras.tolist()):
            frame = FrameRays(
                camera,
                np.array([landmark]),
                times_s[n : n + 1],
                rays[n : n + 1],
                sigmas[n : n + 1],
                clock_sigma_s,
            )
            self._update(frame, np.inf, new=False)
        self.counts.started += 1

    def _drop(self, now_s: float) -> None:
        """End the tracks that are lost."""
        history, rest, recent, _ = self._state
        self.counts.dropped += drop_lost_tracks(
            history.size,
            rest.probability,
            recent.accepted_s,
            recent.observed_s,
            now_s - self._hold_s,
        )

    def estimate(self, time_s: float) -> Estimates:
        """All landmarks at an instant."""
        self._drop(time_s)
        told = empty_telling(len(self._state.history.size), len(self._periods_s))
        tell(self._state, time_s, self._seen_since_s, MODELS, told)
        means, covs, largest_sigma, seen_by, (found, measured, detected, alone) = told
        located = found & measured
        self._located.note(located, means, covs, time_s)
        if not measured.all():
            are = found & alone, located
            self._tell_alone(time_s, are, seen_by, (means, covs, largest_sigma))
            for row in np.flatnonzero(found & ~measured & (largest_sigma > SHOW_SIGMA_M)).tolist():
                # The middle one of three: the larger one across the ray.
                if seen_by[row].any():
                    largest_sigma[row] = np.sqrt(np.linalg.eigvalsh(covs[row])[1])
        found &= (largest_sigma > 0.0) & (largest_sigma <= SHOW_SIGMA_M)
        return Estimates(
            found=found,
            positions_m=means,
            covariances_m2=covs,
            seen_by=seen_by,
            measured=measured,
            detected=detected,
        )

    def _tell_alone(
        self, time_s: float, are: tuple[Bools, Bools], seen_by: Bools, told: tuple[Array, ...]
    ) -> None:
        """What one camera sees alone (one_camera.py).

        are: seen by one alone, and by two, (L,) each. told: means (L, 3), covariances (L, 3, 3) and
        largest sigmas (L,), changed in place.
        """
        means, covs, largest_sigma = told
        centres = self._centres_rig[seen_by.argmax(axis=1)]  # (L, 3)
        memory = self._state.shape, float(self._periods_s.min())
        self._located.tell(time_s, are, centres, memory, (means, covs))
        rows = np.flatnonzero(are[0])
        largest_sigma[rows] = np.sqrt(np.einsum("nii->ni", covs[rows]).max(axis=1))

    def rest_probabilities(self) -> Array:
        """How likely each landmark (L,) rests in its hand, 0 to 1; rest/."""
        return self._state.rest.probability.copy()
