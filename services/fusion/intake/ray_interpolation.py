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

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints

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


@njit(cache=True)
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


@njit(cache=True)
def parabolas_apart(times_s: Array, rays: Array, at_s: float, apart: Array) -> None:
    """The parabola through the last three of four rays (4, 2) less that through the first three.

    At at_s: apart (2,), from the third divided difference. Nothing on samples and on parabolas; the
    cubic lies between the two, and what it misses where an acceleration jumps is a share of it.
    """
    apart[:] = 0.0
    for i in range(4):
        product = 1.0
        for j in range(4):
            if i != j:
                product *= times_s[i] - times_s[j]
        for axis in range(2):
            apart[axis] += rays[i, axis] / product
    apart *= (at_s - times_s[1]) * (at_s - times_s[2]) * (times_s[3] - times_s[0])


class RaySamples(NamedTuple):
    """Where a track keeps its samples, in order of time; as many as are there, at the front."""

    times_s: Array  # (SAMPLES,)
    rays: Array  # (SAMPLES, 2)
    sigmas: Array  # (SAMPLES,)


@njit(cache=True)
def _insert(
    samples: RaySamples, count: int, time_s: float, ray: tuple[float, float], sigma: float
) -> int:
    """RayTrack.add to `count` samples; how many there are then."""
    times_s, rays, sigmas = samples
    index = int(np.searchsorted(times_s[:count], time_s, side="right"))
    if index > 0 and times_s[index - 1] == time_s:
        return count
    if count < len(times_s):
        for k in range(count, index, -1):
            times_s[k], rays[k], sigmas[k] = times_s[k - 1], rays[k - 1], sigmas[k - 1]
        count += 1
    elif index == 0:
        return count
    else:
        index -= 1
        for k in range(index):
            times_s[k], rays[k], sigmas[k] = times_s[k + 1], rays[k + 1], sigmas[k + 1]
    times_s[index], rays[index, 0], rays[index, 1], sigmas[index] = time_s, ray[0], ray[1], sigma
    return count


class RayTracks(NamedTuple):
    """The samples of L landmarks in C cameras, as RaySamples has each one's; and how many."""

    times_s: Array  # (L, C, SAMPLES)
    rays: Array  # (L, C, SAMPLES, 2)
    sigmas: Array  # (L, C, SAMPLES)
    counts: Ints  # (L, C)


def no_tracks(landmarks: int, cameras: int) -> RayTracks:
    """Nothing seen yet."""
    each = (landmarks, cameras, SAMPLES)
    return RayTracks(
        np.empty(each), np.empty((*each, 2)), np.empty(each), np.zeros(each[:2], dtype=np.int64)
    )


@njit(cache=True)
def samples_of(tracks: RayTracks, landmark: int, camera: int) -> RaySamples:
    """One track's; views."""
    return RaySamples(
        tracks.times_s[landmark, camera],
        tracks.rays[landmark, camera],
        tracks.sigmas[landmark, camera],
    )


@njit(cache=True)
def add_frame(
    tracks: RayTracks, camera: int, landmarks: Ints, times_s: Array, rays: Array, sigmas: Array
) -> None:
    """RayTrack.add for all landmarks (n,) of a frame."""
    for n in range(landmarks.size):
        k = landmarks[n]
        ray = rays[n, 0], rays[n, 1]
        samples, count = samples_of(tracks, k, camera), tracks.counts[k, camera]
        tracks.counts[k, camera] = _insert(samples, count, times_s[n], ray, sigmas[n])


@njit(cache=True)
def interpolate(
    samples: RaySamples,
    count: int,
    time_s: float,
    period_s: float,
    reach: int,
    ray: Array,
    bend: Array,
) -> tuple[int, float]:
    """RayTrack.at of `count` samples, of which `reach` on each side are used: into ray and bend
    (2,). From how many samples, 0 where they do not give it, and the sigma.
    """
    times_s, rays, sigmas = samples
    after = int(np.searchsorted(times_s[:count], time_s, side="right"))
    if not 0 < after < count or times_s[after] - times_s[after - 1] > _GAP_FRAMES * period_s:
        return 0, 0.0
    begin, end = max(after - reach, 0), min(after + reach, count)
    weights = polynomial_weights(times_s[begin:end], time_s)
    variance = 0.0
    ray[:] = 0.0
    bend[:] = 0.0
    for k in range(begin, end):
        weight = weights[k - begin]
        variance += (weight * sigmas[k]) ** 2
        ray[0] += weight * rays[k, 0]
        ray[1] += weight * rays[k, 1]
    if end - begin == 4:
        parabolas_apart(times_s[begin:end], rays[begin:end], time_s, bend)
    return end - begin, math.sqrt(variance)


class RayTrack:
    """One landmark in one camera: its last rays in order of time."""

    def __init__(self) -> None:
        self.samples = RaySamples(np.empty(SAMPLES), np.empty((SAMPLES, 2)), np.empty(SAMPLES))
        self.count = 0

    def add(self, time_s: float, ray: Sequence[float] | Array, sigma: float) -> None:
        """Insert a sample in order of time.

        One at an instant already known, or older than all of a full track, is ignored.
        """
        both = float(ray[0]), float(ray[1])
        self.count = _insert(self.samples, self.count, float(time_s), both, float(sigma))

    def at(self, time_s: float, pairing: Pairing, period_s: float) -> InterpolatedRay | None:
        """The ray at an instant; period_s is the camera's frame time, which tells a gap.

        None if the samples do not give it.
        """
        if pairing == "nearest":
            return self._nearest(time_s, period_s)
        ray, bend = np.empty(2), np.empty(2)
        number, sigma = interpolate(
            self.samples, self.count, float(time_s), period_s, FRAMES_AFTER[pairing], ray, bend
        )
        return InterpolatedRay(ray, sigma, number, bend) if number else None

    def _nearest(self, time_s: float, period_s: float) -> InterpolatedRay | None:
        """The nearest sample to an instant, as it is.

        Its sigma grows by how far it may have moved, judging by its neighbour.
        """
        times, rays, sigmas = (column[: self.count] for column in self.samples)
        if not len(times):
            return None
        k = int(np.argmin(np.abs(times - time_s)))
        away_s = float(abs(times[k] - time_s))
        if away_s > 0.75 * period_s:
            return None
        other = k - 1 if k > 0 else min(1, len(times) - 1)
        elapsed_s = float(abs(times[k] - times[other]))
        speed = 0.0
        if elapsed_s > 0.0:
            speed = float(np.linalg.norm(rays[k] - rays[other])) / elapsed_s
        sigma = float(np.hypot(sigmas[k], speed * away_s))
        return InterpolatedRay(rays[k].copy(), sigma, 1, np.zeros(2))
