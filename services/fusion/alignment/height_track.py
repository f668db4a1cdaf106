"""A marker's height in one camera over time, interpolated: what clocks are compared by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools

# Samples further apart than this many frames are not interpolated.
_GAP_FRAMES = 3.5


class HeightTrack(NamedTuple):
    """One landmark in one camera: n instants by the camera's clock, ascending, and its heights."""

    times_s: Array  # (n,)
    heights: Array  # (n,) y/z in the rectified frame of the pair


def resampled(tracks: Sequence[HeightTrack], grid_s: Array) -> tuple[Array, Array]:
    """Heights (L, N) about their means at a grid's instants, 0 without; where."""
    heights, known = np.zeros((len(tracks), len(grid_s))), np.zeros((len(tracks), len(grid_s)))
    for row, track in enumerate(tracks):
        found, inside = interpolated(track, grid_s)
        mean = float(np.mean(track.heights))
        heights[row] = np.where(inside, found - mean, 0.0)
        known[row] = inside
    return heights, known


def interpolated(track: HeightTrack, at_s: Array, samples: int = 4) -> tuple[Array, Bools]:
    """A track's heights (m,) at instants (m,), and where that holds.

    By cubics through four samples, or by polynomials through another even number.
    """
    found, inside = np.zeros(len(at_s)), np.zeros(len(at_s), dtype=np.bool_)
    if len(track.times_s) >= samples:
        _interpolate(track.times_s, track.heights, at_s, samples, found, inside)
    return found, inside


# Samples of one instant give NaN, as in numpy, and no ZeroDivisionError.
@njit(cache=True, error_model="numpy")
def _interpolate(
    times: Array, heights: Array, at_s: Array, samples: int, found: Array, inside: Bools
) -> None:
    """interpolated(), in place: at each instant the polynomial through the samples about it.

    Lagrange's, as ray_interpolation.polynomial_weights has it, for all instants at once.
    """
    half, count = samples // 2, len(times)
    right = 0
    frame_s = np.median(np.diff(times))
    widest_s = (_GAP_FRAMES + samples - 2) * frame_s
    for n in range(len(at_s)):
        # How many samples are not later: instants mostly follow each other.
        while right < count and times[right] <= at_s[n]:
            right += 1
        while right > 0 and times[right - 1] > at_s[n]:
            right -= 1
        after = min(max(right, half), count - half)
        begin, end = after - half, after + half
        within = times[half - 1] <= at_s[n] <= times[count - half]
        inside[n] = within and times[end - 1] - times[begin] <= widest_s
        for i in range(begin, end):
            weight = 1.0
            for j in range(begin, end):
                if i != j:
                    weight *= (at_s[n] - times[j]) / (times[i] - times[j])
            found[n] += weight * heights[i]
