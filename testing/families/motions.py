"""Motions of six landmarks as functions of time: sharp ones made up. Pure.

All are `Motion` of testing/synthetic_points.py: (n, 6, 3) m in the rig frame at times (n,) or, one
for each landmark, (n, 6). Hands turn by 8 to 20 m/s^2 within a frame when they stop and go, flap
with 0.75 m/s RMS and 1.7 at the peaks; sums of sinusoids do neither.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from rhot.geometry.transforms import Array
from testing.synthetic_points import MovingHand

# Motions are to and fro where a case is longer; they turn round within this time.
_EASE_S = 0.06
_STEP_S = 2e-3


class SampledMotion:
    """Landmarks (n, 6, 3) at times (n,), with a cubic spline between; to and fro for ever."""

    def __init__(self, times_s: Array, points_m: Array) -> None:
        self._spline = CubicSpline(times_s - times_s[0], points_m, axis=0)
        self._span_s = float(times_s[-1] - times_s[0])

    def __call__(self, times_s: Array) -> Array:
        times = np.asarray(times_s, dtype=np.float64).reshape(len(times_s), -1)
        places = self._spline(self._folded(times))  # (n, 1 or 6, 6, 3)
        if times.shape[1] == 1:
            return np.asarray(places[:, 0])
        every = np.arange(times.shape[1])
        return np.asarray(places[:, every, every])

    def _folded(self, times: Array) -> Array:
        """Any time within the recording; it slows down and turns round at both ends."""
        way = np.mod(times, 2.0 * self._span_s)
        way = _eased(np.where(way > self._span_s, 2.0 * self._span_s - way, way))
        return self._span_s - _eased(self._span_s - way)


def _eased(distance: Array) -> Array:
    """Distance to an end, made smooth where it comes near to zero."""
    near = 0.5 * (distance**2 / _EASE_S + _EASE_S)
    return np.where(distance < _EASE_S, near, distance)


def open_hand_m(distance_m: float) -> Array:
    """An open hand before the cameras; (6, 3)."""
    return MovingHand(distance_m=distance_m, speed_m_s=0.0)(np.zeros(1))[0]


def stop_and_go_path(
    acceleration_m_s2: float, seed: int, pause_s: float = 0.25, seconds: float = 12.0
) -> tuple[Array, Array]:
    """Times (n,) and a way (n, 3) from place to place at a constant acceleration, with pauses.

    Accelerations are 60 to 100 % of the given one.
    """
    rng = np.random.default_rng([seed, 1])
    step_s, count = 1e-3, int(seconds * 1e3)
    pushes, n, place = np.zeros((count, 3)), 300, np.zeros(3)
    while n < count:
        goal = rng.uniform(-1.0, 1.0, 3) * (0.12, 0.084, 0.072)
        way = goal - place
        push = acceleration_m_s2 * rng.uniform(0.6, 1.0)
        half = int(np.sqrt(np.linalg.norm(way) / push) / step_s) + 1
        if n + 2 * half >= count:
            break
        pushes[n : n + half] = way / (half * step_s) ** 2
        pushes[n + half : n + 2 * half] = -pushes[n : n + half]
        n += 2 * half + int(rng.uniform(0.0, 2.0 * pause_s) / step_s)
        place = goal
    path = np.cumsum(np.cumsum(pushes, axis=0) * step_s, axis=0) * step_s
    return np.arange(count)[::4] * step_s, path[::4]


def stop_and_go(acceleration_m_s2: float, seed: int, distance_m: float = 0.55) -> SampledMotion:
    """A hand on a stop_and_go_path; its fingers wiggle by a few millimetres."""
    times_s, path = stop_and_go_path(acceleration_m_s2, seed)
    rng = np.random.default_rng([seed, 8])
    omega, phase = 2.0 * np.pi * rng.uniform(1.0, 3.0, (6, 3)), rng.uniform(0.0, 6.28, (6, 3))
    wiggle = 3e-3 * np.sin(omega * times_s[:, None, None] + phase)
    return SampledMotion(times_s, open_hand_m(distance_m) + path[:, None] + wiggle)


def strokes(hz: float, seed: int, seconds: float = 12.0) -> tuple[Array, Array]:
    """Times (n,) and a way (n,) from -1 to 1 and back: straight, turned round within 50 ms."""
    rng = np.random.default_rng([seed, 2])
    times_s = np.arange(0.0, seconds, _STEP_S)
    drift = np.sin(2.0 * np.pi * rng.uniform(0.2, 0.3) * times_s)
    phase = np.cumsum(hz * (1.0 + 0.45 * drift)) * _STEP_S
    way = 2.0 * np.abs(2.0 * (phase - np.floor(phase + 0.5))) - 1.0
    window = np.hanning(27)[1:-1]
    smooth = np.convolve(np.pad(way, 25, mode="edge"), window / window.sum(), "same")[25:-25]
    return times_s, smooth


def flapping(hz: float, amplitude_deg: float, seed: int, distance_m: float = 0.5) -> SampledMotion:
    """A hand that flaps about its wrist."""
    times_s, way = strokes(hz, seed)
    angles = np.deg2rad(amplitude_deg) * way
    return SampledMotion(times_s, _turned_about_x(open_hand_m(distance_m), angles))


def _turned_about_x(hand_m: Array, angles_rad: Array) -> Array:
    """A hand (6, 3) turned about its wrist by n angles; (n, 6, 3)."""
    arms = hand_m - hand_m[0]
    c, s = np.cos(angles_rad)[:, None], np.sin(angles_rad)[:, None]
    x = np.broadcast_to(arms[:, 0], (len(angles_rad), 6))
    turned = [x, c * arms[:, 1] - s * arms[:, 2], s * arms[:, 1] + c * arms[:, 2]]
    return hand_m[0] + np.stack(turned, axis=2)


def _ramp(share: Array) -> Array:
    """0 below 0, 1 above 1, with a parabola's constant acceleration between."""
    u = np.clip(share, 0.0, 1.0)
    return np.where(u < 0.5, 2.0 * u**2, 1.0 - 2.0 * (1.0 - u) ** 2)


def tapping(hz: float, depth_m: float, seed: int, distance_m: float = 0.5) -> SampledMotion:
    """Fingers that tap one after the other: down within 60 ms, up within 90, then they rest.

    The hand drifts by some millimetres meanwhile.
    """
    rng = np.random.default_rng([seed, 3])
    times_s = np.arange(0.0, 12.0, _STEP_S)
    points = np.tile(open_hand_m(distance_m), (len(times_s), 1, 1))
    begins = np.arange(0.2, 11.5, 1.0 / hz)
    for begin_s in begins + rng.uniform(-0.04, 0.04, len(begins)):
        down = _ramp((times_s - begin_s) / 0.06) - _ramp((times_s - begin_s - 0.09) / 0.09)
        points[:, rng.integers(1, 6), 1:] += down[:, None] * depth_m * np.array([0.5, 0.85])
    omega, phase = 2.0 * np.pi * rng.uniform(0.1, 0.5, 3), rng.uniform(0.0, 6.28, 3)
    drift = 4e-3 * np.sin(omega * times_s[:, None] + phase)
    return SampledMotion(times_s, points + drift[:, None])


def clapping(hz: float, stroke_m: float, seed: int, distance_m: float = 0.55) -> SampledMotion:
    """A hand that claps against another: it goes one way, is stopped within 15 ms, and comes back.

    Half of each period is rest.
    """
    rng = np.random.default_rng([seed, 4])
    times_s = np.arange(0.0, 12.0, 1e-3)
    phase = np.mod(times_s * hz * (1.0 + 0.02 * np.sin(2.0 * times_s)), 1.0)
    # Towards the other hand ever faster, away from it gently.
    there = np.where(phase < 0.3, (phase / 0.3) ** 2, 1.0 - _ramp((phase - 0.3) / 0.35))
    window = np.hanning(17)[1:-1]
    stroke = np.convolve(np.pad(there, 20, mode="edge"), window / window.sum(), "same")[20:-20]
    hand = open_hand_m(distance_m)
    path = stroke_m * (stroke[:, None] - 0.5) * np.array([1.0, 0.1, 0.25])
    lag = rng.uniform(0.9, 1.1, (6, 1))  # the fingers' reach differs
    points = hand + path[:, None] * lag
    return SampledMotion(times_s[::2], points[::2])


def rolling(hz: float, amplitude_deg: float, seed: int, distance_m: float = 0.5) -> SampledMotion:
    """A hand that rolls about its forearm and splays its fingers, waiting at both ends."""
    rng = np.random.default_rng([seed, 5])
    times_s = np.arange(0.0, 12.0, _STEP_S)
    hand = open_hand_m(distance_m)
    angle = np.deg2rad(amplitude_deg) * back_and_forth(times_s, hz, 0.3)
    spread = 1.0 + 0.22 * back_and_forth(times_s + rng.uniform(0.0, 1.0), 0.8 * hz, 0.2)
    arms = hand - hand[0]
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, z = arms[:, 0] * spread[:, None], np.broadcast_to(arms[:, 2], (len(times_s), 6))
    y = np.broadcast_to(arms[:, 1], x.shape)
    points = hand[0] + np.stack([c * x + s * z, y, c * z - s * x], axis=2)
    return SampledMotion(times_s, points)


def back_and_forth(times_s: Array, hz: float, wait: float) -> Array:
    """-1 .. 1 .. -1, with a share of each half period spent waiting at its end."""
    phase = np.mod(times_s * hz, 1.0) * 2.0
    way = _ramp(np.where(phase < 1.0, phase, phase - 1.0) / (1.0 - wait))
    return np.where(phase < 1.0, 2.0 * way - 1.0, 1.0 - 2.0 * way)
