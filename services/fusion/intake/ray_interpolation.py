"""A camera's ray to a landmark at any instant, interpolated between its frames.

Two free-running cameras see a moving hand up to half a frame apart. Pairing nearest frames turns
that into tens of millimetres of depth (depth error = Z * v * dt / B). So rays are interpolated:
nearest frame, straight line, or the 4-point Hermite cubic.

Interpolation needs later frames: it waits. An instant that the track does not enclose yet, or
across a gap in the track, gives None: the caller decides whether to wait or to do without. Where
one of the four points is missing, at the end of a track or as a frame was lost, the parabola
through three takes the cubic's place.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot.geometry.transforms import Array

Pairing = Literal["hermite", "linear", "nearest"]

# How many frames later than the wanted instant each kind needs.
FRAMES_AFTER: dict[Pairing, int] = {"nearest": 0, "linear": 1, "hermite": 2}
# Samples kept for each landmark and camera: four points, two frames of lag, and room for frames
# that come out of order.
SAMPLES = 16
# Samples further apart than this many frames are not interpolated: the motion between is unknown.
_GAP_FRAMES = 3.5


@dataclass(frozen=True, eq=False)
class InterpolatedRay:
    """A camera's ray to a landmark at the wanted instant."""

    ray: Array  # (2,)
    sigma: float  # of each coordinate
    samples: int  # from how many it is interpolated
    bend: (
        Array  # (2,) by how much the parabolas through the first and the last three of four differ
    )


def polynomial_weights(times_s: Array, at_s: float) -> Array:
    """Weights (n,) of n samples at times (n,) in the polynomial through them at at_s (Lagrange).

    Of four: the Hermite cubic between the middle two whose tangents are those of the cubic through
    all four, hence exact on cubics; at the middle of even spacing the familiar (-1, 9, 9, -1) / 16,
    which passes .8 of the samples' noise. Of two: the straight line.
    """
    n = len(times_s)
    weights = np.ones(n)
    for i in range(n):
        for j in range(n):
            if i != j:
                weights[i] *= (at_s - times_s[j]) / (times_s[i] - times_s[j])
    return weights


def parabolas_apart(times_s: Array, rays: Array, at_s: float) -> Array:
    """The parabola through the last three of four rays (4, 2) less that through the first three.

    At at_s: (2,), from the third divided difference. Nothing on samples and on parabolas; the
    cubic lies between the two, and what it misses where an acceleration jumps is a share of it.
    """
    apart = times_s[:, None] - times_s[None, :] + np.eye(4)  # (4, 4)
    third = (1.0 / np.prod(apart, axis=1)) @ rays  # (2,)
    span = (at_s - times_s[1]) * (at_s - times_s[2]) * (times_s[3] - times_s[0])
    return np.asarray(span * third)


class RayTrack:
    """One landmark in one camera: its last rays in order of time."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._rays: list[Array] = []
        self._sigmas: list[float] = []

    def add(self, time_s: float, ray: Array, sigma: float) -> None:
        """Insert a sample in order of time.

        One at an instant already known, or older than all of a full track, is ignored.
        """
        index = bisect_right(self._times, time_s)
        known = index > 0 and self._times[index - 1] == time_s
        if known or (index == 0 and len(self._times) >= SAMPLES):
            return
        self._times.insert(index, time_s)
        self._rays.insert(index, np.asarray(ray, dtype=np.float64))
        self._sigmas.insert(index, sigma)
        if len(self._times) > SAMPLES:
            del self._times[0], self._rays[0], self._sigmas[0]

    def newest(self, n: int) -> list[tuple[float, Array, float]]:
        """The last n samples, newest first: time, ray (2,), sigma."""
        newest_first = slice(None, -n - 1, -1)
        return list(
            zip(
                self._times[newest_first],
                self._rays[newest_first],
                self._sigmas[newest_first],
                strict=True,
            )
        )

    def at(self, time_s: float, pairing: Pairing, period_s: float) -> InterpolatedRay | None:
        """The ray at an instant; period_s is the camera's frame time, which tells a gap.

        None if the samples do not give it.
        """
        if not self._times:
            return None
        after = bisect_right(self._times, time_s)
        around = [k for k in (after - 1, after) if 0 <= k < len(self._times)]
        if pairing == "nearest":
            return self._nearest(around, time_s, period_s)
        if len(around) < 2 or self._times[after] - self._times[after - 1] > _GAP_FRAMES * period_s:
            return None
        if pairing == "hermite":
            around = [k for k in range(after - 2, after + 2) if 0 <= k < len(self._times)]
        times_s = np.array([self._times[k] for k in around])
        weights = polynomial_weights(times_s, time_s)
        rays = np.array([self._rays[k] for k in around])
        sigmas = np.array([self._sigmas[k] for k in around])
        sigma = float(np.sqrt(np.sum((weights * sigmas) ** 2)))
        bend = parabolas_apart(times_s, rays, time_s) if len(around) == 4 else np.zeros(2)
        return InterpolatedRay(weights @ rays, sigma, len(around), bend)

    def _nearest(self, around: list[int], time_s: float, period_s: float) -> InterpolatedRay | None:
        """The nearest of the samples `around` an instant, as it is.

        Its sigma grows by how far it may have moved, judging by its neighbour.
        """
        k = min(around, key=lambda k: abs(self._times[k] - time_s))
        away_s = abs(self._times[k] - time_s)
        if away_s > 0.75 * period_s:
            return None
        other = k - 1 if k > 0 else min(1, len(self._times) - 1)
        elapsed_s = abs(self._times[k] - self._times[other])
        speed = 0.0
        if elapsed_s > 0.0:
            speed = float(np.linalg.norm(self._rays[k] - self._rays[other])) / elapsed_s
        return InterpolatedRay(
            self._rays[k], float(np.hypot(self._sigmas[k], speed * away_s)), 1, np.zeros(2)
        )
