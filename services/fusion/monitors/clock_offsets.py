"""What is left of the cameras' clock errors, estimated from the markers themselves.

Two views of one instant agree in height above the baseline (the epipolar constraint). If a camera's
stamps are late by tau, its markers' heights are those of tau earlier: the difference is tau times
their speed in the image. A small Kalman filter over all pairs of cameras estimates each camera's
tau from that, beginning with the uncertainty its clock estimate claims, and beside it each pair's
constant height error, which tells a bumped camera. At 0.7 m, 1 ms is 2-5 mm of depth of a moving
hand, so this is worth a lot.

A still hand, or one that moves along the baseline only, tells nothing: the offsets stay, their
uncertainty grows slowly. A clock that was set anew (its announced offset jumps), or views that
contradict for long, start the estimation again.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.intake.observations import CLOCK_SIGMA_MAX_S, View
from services.fusion.intake.ray_interpolation import RayTrack
from services.fusion.monitors.epipolar_error import EpipolarError, epipolar_error
from services.fusion.monitors.moved_camera import MovedCameraMonitor

# Seconds between two updates by one pair of cameras: each costs 1 ms, and ten a second of six
# markers reach .05 ms within a second or two.
UPDATE_S = 0.1
# No stamp is better than this (a tenth of an exposure's jitter); keeps the filter able to follow.
_CLOCK_FLOOR_S = 2e-5
# Heights of a calibrated pair differ by this much over the image (stereo RMS of real pairs is .22
# px, half of it in height).
_HEIGHT_SIGMA_PX = 1.0
_NOISE_PX = 0.1
# Random walks per square root of a second: an uncorrected drift of 50 ppm is .05 ms a second; a
# warming mount moves slower than this.
_CLOCK_WALK_S, _HEIGHT_WALK_PX = 1e-4, 0.01
# Innovations beyond this many sigmas are of two different things; so many more of them than good
# ones mean that the clocks have changed.
_GATE, _CONTRADICTIONS = 4.0, 24
# So long without a common instant of two views, as their clocks are taken to be more than a frame
# apart (interpolation reaches no further), means that they are not: a camera that is bumped and put
# back drove them there.
_LOST_S = 2.0
# Share of a new squared residual in its running mean: over the last hundred or so observations.
_NEW_RESIDUAL = 0.01


class ClockOffsetEstimator:
    """Clock errors of all C cameras (s) and height errors of all P pairs (normalised units)."""

    def __init__(
        self, cameras: tuple[Camera, ...], landmarks: int, periods_s: Array, *, enabled: bool
    ) -> None:
        """periods_s (C,) are the cameras' frame times.

        Not enabled, it passes the announced uncertainties on and watches only.
        """
        self._pairs = rectified_pairs(cameras)
        self._names = [camera.name for camera in cameras]
        self._landmarks = landmarks
        self._periods_s = periods_s
        self._enabled = enabled
        self._moved = MovedCameraMonitor(len(self._pairs))
        self.updates = 0
        self.gated = 0
        # Mean square of the epipolar residual, in px^2 of the mean focal length.
        self._residual_px2 = 0.0
        self.reset()

    def reset(self) -> None:
        """Time starts anew: forget tracks and offsets."""
        cameras = len(self._names)
        self._tracks = [[RayTrack() for _ in range(cameras)] for _ in range(self._landmarks)]
        self._updated_s = dict.fromkeys(self._pairs, -np.inf)
        self._compared_s = dict.fromkeys(self._pairs, np.inf)
        # By camera: its announced offset (ns) and how far that may be off (s).
        self._announced: list[tuple[int, float] | None] = [None] * cameras
        self._state = np.zeros(cameras + len(self._pairs))  # (C + P,)
        self._cov = self._prior_cov()
        self._contradictions = 0

    def _prior_cov(self) -> Array:
        """Covariance (C + P, C + P) while nothing is known."""
        clocks = [CLOCK_SIGMA_MAX_S**2] * len(self._names)
        height_sigmas = np.array(
            [_HEIGHT_SIGMA_PX / pair.focal_px for pair in self._pairs.values()]
        )
        return np.diag([*clocks, *(height_sigmas**2).tolist()])

    @property
    def epipolar_px(self) -> float:
        """RMS height difference of paired views, px.

        Some tenths on a calibrated rig with agreeing clocks.
        """
        return float(np.sqrt(self._residual_px2))

    @property
    def late_s(self) -> dict[str, float]:
        """By how much each camera's stamps are late, beyond its announced offset."""
        return {name: float(late_s) for name, late_s in zip(self._names, self._state, strict=False)}

    @property
    def heights_px(self) -> dict[str, float]:
        """The constant height error of each pair of cameras, by `first_second`: a bumped camera."""
        heights = self._state[len(self._names) :]
        return {
            f"{self._names[first]}_{self._names[second]}": float(height) * pair.focal_px
            for ((first, second), pair), height in zip(self._pairs.items(), heights, strict=True)
        }

    @property
    def moved_px(self) -> dict[tuple[str, str], float]:
        """Pairs of cameras whose views have not fitted for seconds, and by how much.

        One of them was bumped since it was calibrated.
        """
        found = {}
        for index, (first, second) in enumerate(self._pairs):
            height_px = self._moved.height_px(index)
            if height_px is not None:
                found[self._names[first], self._names[second]] = height_px
        return found

    def observe(self, view: View, times_s: Array) -> tuple[float, float]:
        """Update by a frame whose observations have times_s (n,), uncorrected.

        Returns its camera's clock error and the sigma of that for pairing, both in s.
        """
        self._note_announced(view)
        for landmark, time_s, ray, sigma in zip(
            view.landmarks.tolist(), times_s.tolist(), view.rays, view.sigmas.tolist(), strict=True
        ):
            self._tracks[landmark][view.camera].add(time_s, ray, sigma)
        if len(times_s):
            newest_s = float(times_s.max())
            for index, pair in enumerate(self._pairs):
                elapsed_s = newest_s - self._updated_s[pair]
                if view.camera in pair and elapsed_s >= UPDATE_S * len(self._pairs):
                    self._predict(elapsed_s)
                    self._updated_s[pair] = newest_s
                    self._update_pair(index, pair, view, newest_s)
        return float(self._state[view.camera]), self._pairing_sigma_s(view.camera)

    def _note_announced(self, view: View) -> None:
        """Start anew for a camera whose clock was set, or is heard of for the first time."""
        sigma_s = max(view.clock_sigma_s, _CLOCK_FLOOR_S)
        c = view.camera
        known = self._announced[c]
        if known is None or abs(view.clock_offset_ns - known[0]) * 1e-9 > max(1e-3, 3.0 * known[1]):
            self._state[c] = 0.0
            self._cov[c, :] = 0.0
            self._cov[:, c] = 0.0
            self._cov[c, c] = sigma_s**2
        self._announced[c] = (view.clock_offset_ns, sigma_s)

    def _predict(self, elapsed_s: float) -> None:
        """Process noise: uncertainty grows, up to what the clock estimates themselves claim."""
        elapsed_s = min(elapsed_s, 1.0) / len(self._pairs)
        for c, announced in enumerate(self._announced):
            limit_s = CLOCK_SIGMA_MAX_S if announced is None else announced[1]
            grown = self._cov[c, c] + _CLOCK_WALK_S**2 * elapsed_s
            self._cov[c, c] = max(self._cov[c, c], min(grown, limit_s**2))
        for n, pair in enumerate(self._pairs.values(), start=len(self._names)):
            self._cov[n, n] += (_HEIGHT_WALK_PX / pair.focal_px) ** 2 * elapsed_s

    def _update_pair(
        self, index: int, cameras: tuple[int, int], view: View, newest_s: float
    ) -> None:
        """Update by all landmarks of a view that the other camera of a pair has seen as well."""
        first, second = cameras
        pair = self._pairs[cameras]
        period_s = float(self._periods_s[second])
        for landmark in view.landmarks.tolist():
            tracks = self._tracks[landmark]
            shift_s = float(self._state[second] - self._state[first])
            error = epipolar_error(pair, tracks[first], tracks[second], shift_s, period_s)
            if error is not None:
                self._compared_s[cameras] = newest_s
                self._moved.observe(index, abs(error.height) * pair.focal_px)
                self._update(index, cameras, error)
        apart_s = abs(float(self._state[second] - self._state[first]))
        if newest_s - self._compared_s[cameras] > _LOST_S and apart_s > period_s:
            self._state[:] = 0.0
            self._cov = self._prior_cov()

    def _update(self, index: int, cameras: tuple[int, int], error: EpipolarError) -> None:
        """The Kalman update by one landmark's height difference."""
        first, second = cameras
        focal_px = self._pairs[cameras].focal_px
        height_row = len(self._names) + index
        H = np.zeros(len(self._state))  # (C + P,)
        H[first] = -error.speed
        H[second] = error.speed
        H[height_row] = 1.0
        PHt = self._cov @ H  # (C + P,)
        S = float(H @ PHt) + error.variance + (_NOISE_PX / focal_px) ** 2
        # The clocks' part is in the height already: it was taken with this state's shift.
        innovation = error.height - float(self._state[height_row])
        residual_px2 = min((innovation * focal_px) ** 2, 1e6)
        self._residual_px2 += _NEW_RESIDUAL * (residual_px2 - self._residual_px2)
        if innovation * innovation > _GATE**2 * S:
            self._note_gated()
            return
        self.updates += 1
        self._contradictions = max(0, self._contradictions - 1)
        if self._enabled:
            self._state += PHt * (innovation / S)
            self._cov -= np.outer(PHt, PHt) / S

    def _note_gated(self) -> None:
        """Something does not fit: a wrong marker now and then, or clocks that have changed."""
        self.gated += 1
        self._contradictions += 1
        if self._contradictions >= _CONTRADICTIONS:
            self._contradictions = 0
            self._cov = self._prior_cov()

    def _pairing_sigma_s(self, camera: int) -> float:
        """Uncertainty of a camera's clock against the others'.

        Such that two cameras' sigmas add up to that of their difference.
        """
        n = len(self._names)
        weights = np.full(n, -1.0 / n)
        weights[camera] += 1.0
        variance = weights @ self._cov[:n, :n] @ weights
        return float(np.sqrt(max(variance, 0.0) * n / max(n - 1, 1)))
