"""What is left of the cameras' clock errors, learned from the markers themselves.

Two views of one instant agree in height above the baseline (the epipolar constraint). If a camera's
stamps are late by tau, its markers' heights are those of tau earlier: the difference is tau times
their speed in the picture. A small Kalman filter over all pairs of cameras learns each camera's tau
from that, beginning with the uncertainty its clock estimate claims, and beside it each pair's
constant height error, which tells a bumped camera. At 0.7 m, 1 ms is 2-5 mm of depth of a moving
hand, so this is worth a lot.

A still hand, or one that moves along the baseline only, teaches nothing: the corrections stay,
their uncertainty grows slowly. A clock that was set anew (its announced offset jumps), or views
that contradict for long, start the learning again.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.intake.observations import CLOCK_SIGMA_MAX_S, View
from services.fusion.intake.ray_interpolation import RayTrack
from services.fusion.paired.depth_law import RectifiedPair, rectified_pair

# Seconds between two lessons of one pair of cameras: each costs 1 ms, and ten a second of six
# markers reach .05 ms within a second or two.
LESSON_S = 0.1
# No stamp is better than this (a tenth of an exposure's jitter); keeps the filter able to learn.
_CLOCK_FLOOR_S = 2e-5
# Heights of a calibrated pair differ by this much over the picture (stereo RMS of real pairs is .22
# px, half of it in height).
_HEIGHT_SIGMA_PX = 1.0
_NOISE_PX = 0.1
# Random walks per square root of a second: an uncorrected drift of 50 ppm is .05 ms a second; a
# warming mount moves slower than this.
_CLOCK_WALK_S, _HEIGHT_WALK_PX = 1e-4, 0.01
# Lessons beyond this many sigmas are of two different things; so many more of them than good ones
# mean that the clocks have changed.
_GATE, _CONTRADICTIONS = 4.0, 24
# A landmark moves if its speed is this many times its uncertainty (1.6 sigma per frame time for the
# cubic's slope).
_MOVING = 8.0
# Heights that differ by more than this are not a calibrated pair's (stereo RMS of real pairs is .22
# px; a bump of .2 deg is 1.8 px), ...
MOVED_PX = 1.5
# ... and if two in five of the last hundred looks (2 s of six markers) do, it is no wrong marker
# and no fast motion: a camera rolled by 3 deg moves four in six of a hand's markers that far.
_MOVED_NEW, _MOVED_SHARE, _MOVED_OVER = 0.01, 0.4, 0.2
# Half the step of the numerical speed: short against a frame.
_STEP_S = 1e-3


class ClockTuner:
    """Corrections of all cameras' clocks: state (C + pairs,) of clock errors in s and height errors
    in normalised units.
    """

    def __init__(
        self, cameras: tuple[Camera, ...], slots: int, periods_s: Array, *, enabled: bool
    ) -> None:
        """periods_s (C,) are the cameras' frame times.

        Not enabled, it passes the announced uncertainties on and watches only.
        """
        found = {
            (i, j): rectified_pair(cameras[i], cameras[j])
            for i, j in combinations(range(len(cameras)), 2)
        }
        self._pairs: dict[tuple[int, int], RectifiedPair] = {
            key: pair for key, pair in found.items() if pair is not None
        }
        self._cameras, self._slots = len(cameras), slots
        self._names = [camera.name for camera in cameras]
        self._periods_s = periods_s
        self._enabled = enabled
        self.lessons = 0
        self.contradicted = 0
        # Mean square of the epipolar residual, in px^2 of the mean focal length, over the last
        # hundred or so looks.
        self._residual2 = 0.0
        # Per pair: the share of looks beyond MOVED_PX, the mean size of these, and whether it is
        # reported.
        self._beyond = np.zeros((len(self._pairs), 2))
        self._moved = np.zeros(len(self._pairs), dtype=bool)
        self._height_sigmas = np.array(
            [_HEIGHT_SIGMA_PX / pair.focal_px for pair in self._pairs.values()]
        )
        self.reset()

    def reset(self) -> None:
        """Time starts anew: forget tracks and corrections."""
        self._tracks = [[RayTrack() for _ in range(self._cameras)] for _ in range(self._slots)]
        self._lesson_s = dict.fromkeys(self._pairs, -np.inf)
        self._announced: list[tuple[int, float] | None] = [None] * self._cameras
        self._state = np.zeros(self._cameras + len(self._pairs))
        self._cov = np.diag(
            [*[CLOCK_SIGMA_MAX_S**2] * self._cameras, *(self._height_sigmas**2).tolist()]
        )
        self._doubt = 0

    @property
    def epipolar_px(self) -> float:
        """RMS height difference of paired views, px: some tenths on a calibrated rig with agreeing
        clocks.
        """
        return float(np.sqrt(self._residual2))

    @property
    def late_s(self) -> dict[str, float]:
        """By how much each camera's stamps are late, beyond its announced offset."""
        return {name: float(late_s) for name, late_s in zip(self._names, self._state, strict=False)}

    @property
    def heights_px(self) -> dict[str, float]:
        """The constant height error of each pair of cameras, by `first_second`: a bumped camera."""
        heights = self._state[self._cameras :]
        pairs = zip(self._pairs.items(), heights, strict=True)
        return {
            f"{self._names[a]}_{self._names[b]}": float(height) * pair.focal_px
            for ((a, b), pair), height in pairs
        }

    @property
    def moved_px(self) -> dict[tuple[str, str], float]:
        """Pairs of cameras whose views have not fitted for seconds, and by how much: one of them
        was bumped since it was calibrated.
        """
        found = {}
        for (a, b), moved, (_, size) in zip(
            self._pairs, self._moved.tolist(), self._beyond.tolist(), strict=True
        ):
            if moved:
                found[self._names[a], self._names[b]] = size
        return found

    def observe(self, view: View, times_s: Array) -> tuple[float, float]:
        """Learn from a frame whose observations have times_s (n,) uncorrected.

        Its camera's correction and sigma for pairing, both in s.
        """
        self._announce(view)
        for slot, time_s, ray, sigma in zip(
            view.slots.tolist(), times_s.tolist(), view.rays, view.sigma.tolist(), strict=True
        ):
            self._tracks[slot][view.camera].add(time_s, ray, sigma)
        if len(times_s):
            newest_s = float(times_s.max())
            for index, pair in enumerate(self._pairs):
                if view.camera in pair and newest_s - self._lesson_s[pair] >= LESSON_S * len(
                    self._pairs
                ):
                    self._walk(newest_s - self._lesson_s[pair])
                    self._lesson_s[pair] = newest_s
                    self._learn(index, pair, view)
        return float(self._state[view.camera]), self._sigma(view.camera)

    def _announce(self, view: View) -> None:
        """Begin anew for a camera whose clock was set, or is heard of for the first time."""
        sigma_s = max(view.clock_sigma_s, _CLOCK_FLOOR_S)
        c, known = view.camera, self._announced[view.camera]
        if known is None or abs(view.clock_offset_ns - known[0]) * 1e-9 > max(1e-3, 3.0 * known[1]):
            self._state[c] = 0.0
            self._cov[c, :], self._cov[:, c] = 0.0, 0.0
            self._cov[c, c] = sigma_s**2
        self._announced[c] = (view.clock_offset_ns, sigma_s)

    def _walk(self, elapsed_s: float) -> None:
        """Uncertainty grows with time, up to what the clock estimates themselves claim."""
        elapsed_s = min(elapsed_s, 1.0) / len(self._pairs)
        for c, announced in enumerate(self._announced):
            limit = CLOCK_SIGMA_MAX_S if announced is None else announced[1]
            self._cov[c, c] = max(
                self._cov[c, c], min(self._cov[c, c] + _CLOCK_WALK_S**2 * elapsed_s, limit**2)
            )
        for n, pair in enumerate(self._pairs.values(), start=self._cameras):
            self._cov[n, n] += (_HEIGHT_WALK_PX / pair.focal_px) ** 2 * elapsed_s

    def _learn(self, index: int, pair: tuple[int, int], view: View) -> None:
        first, second = pair
        for slot in view.slots.tolist():
            look = self._look(slot, first, second)
            if look is None:
                continue
            height, speed, variance = look
            focal_px = self._pairs[pair].focal_px
            H = np.zeros(len(self._state))
            H[first], H[second], H[self._cameras + index] = -speed, speed, 1.0
            gain = self._cov @ H
            S = float(H @ gain) + variance + (_NOISE_PX / focal_px) ** 2
            left = height - float(self._state[self._cameras + index])
            self._watch(index, abs(height) * focal_px)
            self._residual2 += 0.01 * (min((left * focal_px) ** 2, 1e6) - self._residual2)
            if left * left > _GATE**2 * S:
                self._contradict()
                continue
            self.lessons += 1
            self._doubt = max(0, self._doubt - 1)
            if self._enabled:
                self._state += gain * (left / S)
                self._cov -= np.outer(gain, gain) / S

    def _watch(self, index: int, height_px: float) -> None:
        """Note one look's height difference."""
        beyond = self._beyond[index]
        beyond[0] += _MOVED_NEW * ((height_px > MOVED_PX) - beyond[0])
        if height_px > MOVED_PX:
            beyond[1] += (
                0.05 * (min(height_px, 1e3) - beyond[1]) if beyond[1] else min(height_px, 1e3)
            )
        # Once reported it stays so until most looks fit again.
        self._moved[index] = beyond[0] > (_MOVED_OVER if self._moved[index] else _MOVED_SHARE)

    def _contradict(self) -> None:
        """Something does not fit: a wrong marker now and then, or clocks that have changed."""
        self.contradicted += 1
        self._doubt += 1
        if self._doubt >= _CONTRADICTIONS:
            self._doubt = 0
            self._cov = np.diag(
                [*[CLOCK_SIGMA_MAX_S**2] * self._cameras, *(self._height_sigmas**2).tolist()]
            )

    def _look(self, slot: int, first: int, second: int) -> tuple[float, float, float] | None:
        """Height difference of one landmark in two cameras at one instant, its speed (1/s) in the
        second's picture, and variance.
        """
        pair, (a, b) = (
            self._pairs[first, second],
            (self._tracks[slot][first], self._tracks[slot][second]),
        )
        shift_s = float(self._state[second] - self._state[first])
        for time_s, ray, sigma in a.newest(4):
            period_s = float(self._periods_s[second])
            at = [
                b.at(time_s + shift_s + step_s, "hermite", period_s)
                for step_s in (-_STEP_S, 0.0, _STEP_S)
            ]
            # The error of a parabola through three points is proportional to the speed of a
            # swinging hand: it would pass for a late clock.
            looks = [look for look in at if look is not None and look.samples == 4]
            if len(looks) < 3:
                continue
            before, now, after = (_height(pair.R_rectified_from_second, look.ray) for look in looks)
            speed = (after - before) / (2.0 * _STEP_S)
            # Speed that is but noise shares that noise with the height, and would teach a clock
            # error of about half a frame.
            moving = abs(speed) > _MOVING * looks[1].sigma / period_s
            return (
                _height(pair.R_rectified_from_first, ray) - now,
                speed if moving else 0.0,
                sigma**2 + looks[1].sigma ** 2,
            )
        return None

    def _sigma(self, camera: int) -> float:
        """Uncertainty of a camera's clock against the others', such that two cameras' sigmas add up
        to that of their difference.
        """
        n = self._cameras
        weights = np.full(n, -1.0 / n)
        weights[camera] += 1.0
        return float(np.sqrt(max(weights @ self._cov[:n, :n] @ weights, 0.0) * n / max(n - 1, 1)))


def _height(R_rectified_from_camera: Array, ray: Array) -> float:
    """y/z of a ray (2,) in the rectified frame."""
    _, y, z = R_rectified_from_camera @ np.array([ray[0], ray[1], 1.0])
    return float(y / z) if z > 0.0 else float("inf")
