"""What is left of the cameras' clock errors, estimated from the markers themselves.

Two views of one instant agree in height above the baseline (the epipolar constraint). If a camera's
stamps are late by tau, its markers' heights are those of tau earlier: the difference is tau times
their speed in the image. For each pair of cameras a robust regression over the last seconds of
motion finds tau and the constant height errors (shift_regression.py); with what the clock estimates
claim of themselves that gives each camera's clock. At 0.7 m, 1 ms is 2-5 mm of depth of a moving
hand, so this is worth a lot.

What is learned is bounded by what was announced, as wrong markers must not lead clocks astray, and
rests on the last seconds alone: it is unlearned as fast as it was learned. A still hand, or one
that moves along the baseline only, tells nothing: the offsets stay, their uncertainty grows slowly.
A clock that was set anew (its announced offset jumps) starts the estimation again.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.intake.observations import CLOCK_SIGMA_MAX_S, View
from services.fusion.intake.ray_interpolation import add_frame, no_tracks
from services.fusion.monitors.epipolar_error import epipolar_errors
from services.fusion.monitors.height_window import HeightWindow
from services.fusion.monitors.likeliest_clocks import likeliest_clocks
from services.fusion.monitors.moved_camera import MovedCameraMonitor
from services.fusion.monitors.shift_regression import NOTHING

# Seconds between two updates by the only pair of cameras: ten a second of six markers reach .05 ms
# within a second or two. Of several pairs each is asked less often.
UPDATE_S = 0.1
# No stamp is better than this (a tenth of an exposure's jitter); keeps the filter able to follow.
_CLOCK_FLOOR_S = 2e-5
# Heights of a calibrated pair differ by this much over the image (stereo RMS of real pairs is .22
# px, half of it in height).
_HEIGHT_SIGMA_PX = 1.0
_NOISE_PX = 0.1
# Random walk per square root of a second: an uncorrected drift of 50 ppm is .05 ms a second.
_CLOCK_WALK_S = 1e-4
# A clock is not taken to be farther off than this many of its announced sigmas, or this: two
# cameras may then differ by 5 ms, which a track survives. What is farther off is another matter.
_BOUND_SIGMAS, _BOUND_S = 3.0, 2.5e-3
# Two seconds of motion may outweigh the announced clocks.
_INSTANTS = 20
# The last instants (a second) outweigh what was learned before if they contradict it by so much:
# by 4, noise of 3 px that lasts for some frames does so now and then. Once there are twice as many,
# every fourth one is fitted with those before it: of .1 s more, some seconds say nearly the same.
_RECENT, _CONTRADICTS, _LOOK_BACK = 10, 6.0, 4
# Clocks are doubted of views that could not be compared for so long.
_SILENT_S = 0.5
# Share of a new squared residual in its running mean: over the last hundred or so observations.
_NEW_RESIDUAL = 0.01
_MAX_RESIDUAL_PX2 = 1e6


class ClockOffsetEstimator:
    """Clock errors of all C cameras (s) and height errors of all P pairs (normalised units)."""

    def __init__(
        self, cameras: tuple[Camera, ...], landmarks: int, periods_s: Array, *, enabled: bool
    ) -> None:
        """periods_s (C,) are the cameras' frame times, of FramePace.

        Not enabled, it passes the announced uncertainties on and watches only.
        """
        self._pairs = rectified_pairs(cameras)
        self._names = [camera.name for camera in cameras]
        self._landmarks = landmarks
        self._periods_s = periods_s
        self._enabled = enabled
        self.updates = 0
        self.gated = 0
        self._every_s = 0.5 * UPDATE_S * (1 + len(self._pairs))
        # Mean square of the epipolar residual, in px^2 of the mean focal length.
        self._residual_px2 = 0.0
        self.reset()

    def reset(self) -> None:
        """Time starts anew: forget tracks and offsets."""
        cameras = len(self._names)
        self._tracks = no_tracks(self._landmarks, cameras)
        self._updated_s = dict.fromkeys(self._pairs, -np.inf)
        # By camera: its announced offset (ns) and how far that may be off (s).
        self._announced: list[tuple[int, float] | None] = [None] * cameras
        self._windows = {
            pair: HeightWindow(
                _NOISE_PX / place.focal_px,
                _HEIGHT_SIGMA_PX / place.focal_px,
                _CLOCK_WALK_S * np.sqrt(self._every_s),
            )
            for pair, place in self._pairs.items()
        }
        self._found = dict.fromkeys(self._pairs, NOTHING)
        # By pair: when heights were compared last, the instant of its window that was fitted last,
        # and what `doubted` says of it.
        self._heard_s = dict.fromkeys(self._pairs, -np.inf)
        self._fitted = dict.fromkeys(self._pairs, 0)
        self._doubted = dict.fromkeys(self._pairs, False)
        # By pair: of each landmark, the instant that was compared last.
        self._compared_s = {pair: np.full(self._landmarks, np.nan) for pair in self._pairs}
        self._moved = MovedCameraMonitor(len(self._pairs), self._landmarks)
        self._late_s = np.zeros(cameras)  # (C,)
        self._cov = np.diag(np.full(cameras, CLOCK_SIGMA_MAX_S**2))  # (C, C)
        # By camera: what _of() says of it until something is learned.
        self._known: dict[int, tuple[float, float]] = {}

    @property
    def epipolar_px(self) -> float:
        """RMS height difference of paired views, px.

        Some tenths on a calibrated rig with agreeing clocks.
        """
        return float(np.sqrt(self._residual_px2))

    @property
    def doubted(self) -> bool:
        """Whether heights cannot be compared, or say that clocks are off by more than may be
        learned, or have changed.
        """
        return any(self._doubted.values())

    @property
    def late_s(self) -> dict[str, float]:
        """By how much each camera's stamps are late, beyond its announced offset."""
        return dict(zip(self._names, self._late_s.tolist(), strict=True))

    @property
    def heights(self) -> dict[tuple[int, int], float]:
        """The constant height error of each pair of cameras that is known; normalised units."""
        return {pair: found.height for pair, found in self._found.items() if found.height}

    @property
    def heights_px(self) -> dict[tuple[str, str], float]:
        """The constant height error of each pair of cameras, by their names: a bumped camera."""
        return {
            (self._names[first], self._names[second]): (
                self._found[first, second].height * pair.focal_px
            )
            for (first, second), pair in self._pairs.items()
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
        self.note_announced(view)
        add_frame(self._tracks, view.camera, view.landmarks, times_s, view.rays, view.sigmas)
        if len(times_s):
            newest_s = float(times_s.max())
            for index, pair in enumerate(self._pairs):
                elapsed_s = newest_s - self._updated_s[pair]
                if view.camera in pair and elapsed_s >= self._every_s:
                    self._updated_s[pair] = newest_s
                    if self._update_pair(index, pair, newest_s):
                        self._combine(newest_s)
        return self._of(view.camera)

    def note_announced(self, view: View) -> tuple[float, float]:
        """As observe(), from what was learned before, and of this frame what its clock claims.

        Starts anew for a camera whose clock was set, or is heard of for the first time.
        """
        sigma_s = max(view.clock_sigma_s, _CLOCK_FLOOR_S)
        c = view.camera
        known = self._announced[c]
        if known is None or abs(view.clock_offset_ns - known[0]) * 1e-9 > max(1e-3, 3.0 * known[1]):
            for pair in self._pairs:
                if c in pair:
                    self._windows[pair].clear()
                    self._found[pair], self._fitted[pair] = NOTHING, 0
                    self._doubted[pair] = False
            self._late_s[c] = 0.0
            self._cov[c, :] = 0.0
            self._cov[:, c] = 0.0
            self._cov[c, c] = sigma_s**2
            self._known.clear()
        self._announced[c] = (view.clock_offset_ns, sigma_s)
        return self._of(c)

    def _of(self, camera: int) -> tuple[float, float]:
        """A camera's clock error, and the sigma of that for pairing."""
        if camera not in self._known:
            self._known[camera] = float(self._late_s[camera]), _pairing_sigma_s(self._cov, camera)
        return self._known[camera]

    def _update_pair(self, index: int, cameras: tuple[int, int], newest_s: float) -> bool:
        """Compare the newest heights of all landmarks in two cameras; False if that changes nothing
        yet.
        """
        first, second = cameras
        focal_px = self._pairs[cameras].focal_px
        window = self._windows[cameras]
        shift_s = float(self._late_s[second] - self._late_s[first])
        period_s = float(self._periods_s[second])
        errors = epipolar_errors(
            self._pairs[cameras],
            self._tracks,
            cameras,
            shift_s,
            period_s,
            self._compared_s[cameras],
        )
        if not len(errors.landmarks):
            self._doubted[cameras] |= newest_s - self._heard_s[cameras] > _SILENT_S
            return True
        self._heard_s[cameras] = newest_s
        self._moved.observe(index, newest_s, errors.landmarks, errors.heights * focal_px)
        left_px = (errors.heights - self._found[cameras].height) * focal_px
        self._residual_px2 = _running_mean(self._residual_px2, left_px)
        bound_s = self._bound_s(first) + self._bound_s(second)
        taken = window.add(errors, shift_s, bound_s)
        self.updates += taken
        self.gated += len(errors.landmarks) - taken
        fits = 2 * taken >= len(errors.landmarks)
        self._doubted[cameras] |= not fits
        unfitted = window.newest - self._fitted[cameras]
        looks_back = window.instants > 2 * _RECENT
        if looks_back and unfitted < _LOOK_BACK:
            # A resting hand adds no instants: its clocks become less sure all the same.
            return unfitted == 0
        self._fitted[cameras] = window.newest
        found = window.fit(shift_s)
        self._doubted[cameras] = not fits or abs(found.shift_s) > bound_s
        if looks_back:
            recent = window.fit(shift_s, _RECENT)
            contradicts_s = _CONTRADICTS * math.sqrt(found.variance + recent.variance)
            if abs(recent.shift_s - found.shift_s) > contradicts_s:
                window.keep(_RECENT)
                found = recent
                self._doubted[cameras] = True
        window.adapt_memory(found)
        self._found[cameras] = found
        return True

    def _bound_s(self, camera: int) -> float:
        """How far a camera's clock may be off."""
        return max(_BOUND_SIGMAS * self._announced_sigma_s(camera), _BOUND_S)

    def _announced_sigma_s(self, camera: int) -> float:
        """How far a camera's clock may be off by its own account."""
        known = self._announced[camera]
        return CLOCK_SIGMA_MAX_S if known is None else known[1]

    def _combine(self, newest_s: float) -> None:
        """The clocks that the announced offsets and all pairs' shifts make likeliest."""
        if not self._enabled:
            return
        told = []
        for (first, second), found in self._found.items():
            window = self._windows[first, second]
            still_s = max(newest_s - window.moved_s, 0.0)
            variance = found.variance + _CLOCK_WALK_S**2 * still_s
            told.append((first, second, found.shift_s, variance, window.instants >= _INSTANTS))
        cameras = range(len(self._names))
        self._late_s, self._cov = likeliest_clocks(
            np.array(told, dtype=np.float64),
            np.array([self._announced_sigma_s(camera) for camera in cameras]),
            np.array([self._bound_s(camera) for camera in cameras]),
        )
        self._known.clear()


@njit(cache=True)
def _pairing_sigma_s(cov: Array, camera: int) -> float:
    """Uncertainty of a camera's clock against the others', by the covariance (C, C) of all.

    Such that two cameras' sigmas add up to that of their difference.
    """
    n = len(cov)
    variance = cov[camera, camera] - 2.0 * cov[camera].mean() + cov.mean()
    return math.sqrt(max(variance, 0.0) * n / max(n - 1, 1))


@njit(cache=True)
def _running_mean(mean: float, left_px: Array) -> float:
    """The running mean of squares after some more (n,)."""
    for px in left_px:
        mean += _NEW_RESIDUAL * (min(px**2, _MAX_RESIDUAL_PX2) - mean)
    return mean
