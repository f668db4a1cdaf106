"""The height difference of one landmark between two cameras at one instant: an epipolar residual.

Heights are y/z in the rectified frame of the pair, alike for both cameras if they are calibrated
and their clocks agree.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.geometry.rectified_pair import RectifiedPair, rectify_ray
from services.fusion.intake.ray_interpolation import (
    FRAMES_AFTER,
    RaySamples,
    RayTracks,
    interpolate,
    samples_of,
)

# A landmark moves if its speed is this many times its uncertainty.
_MOVING = 8.0
# Of the bend between four samples (InterpolatedRay.bend), what the cubic through them misses. Where
# that bends by 1 px or more at 30 fps, RMS: a hand that stops and goes with 14 m/s^2 .34, one that
# flaps .47, one that waves .52, one that grabs (110 Hz, jitter of its own) .96; smooth motion bends
# by hundredths.
_MISSED = 0.5
# How many of the first camera's newest samples are tried: so many that clocks which are two frames
# apart still leave one with samples of the second around it.
_NEWEST = 7
# Samples on each side of an instant that a cubic goes through.
_REACH = FRAMES_AFTER["hermite"]
# Neighbours of a sample whose distances differ by more than this share do not give its speed.
_UNEVEN = 0.1


class EpipolarErrors(NamedTuple):
    """n landmarks' heights in the first camera minus those in the second; normalised units."""

    landmarks: Ints  # (n,) ascending
    times_s: Array  # (n,) of the first camera's samples, by its own clock
    heights: Array  # (n,)
    speeds: Array  # (n,) 1/s, of the heights; 0 of one that is not known to move
    spans_s: Array  # (n,) over which the speeds were measured
    variances: Array  # (n,) of the heights: noise, and what interpolation may miss


def epipolar_errors(
    pair: RectifiedPair,
    tracks: RayTracks,
    cameras: tuple[int, int],
    shift_s: float,
    period_s: float,
    compared_s: Array,
) -> EpipolarErrors:
    """The newest height difference that both cameras' tracks of each landmark give.

    shift_s is how much later the second camera's clock reads than the first's, period_s the second
    camera's frame time. compared_s (L,): the instants that were compared last, by the first
    camera's clock, which are not compared again; takes on the new ones.

    The speed is that between the first camera's samples before and after its own. Noise in them
    does not pass for a clock error, however much it is and however it is correlated in time: it is
    another camera's than that of the interpolated height, and lies alike on both sides of the
    sample. (A slope of the same interpolation shares its noise; where that is 2 px, and not the .1
    px that is announced, the difference looks like a clock error of up to half a frame.)
    """
    rotations = pair.R_rectified_from_first, pair.R_rectified_from_second
    return EpipolarErrors(
        *_newest_errors(rotations, tracks, cameras, shift_s, period_s, compared_s)
    )


@njit(cache=True)
def _newest_errors(
    rotations: tuple[Array, Array],
    tracks: RayTracks,
    cameras: tuple[int, int],
    shift_s: float,
    period_s: float,
    compared_s: Array,
) -> tuple[Ints, Array, Array, Array, Array, Array]:
    """What epipolar_errors has."""
    first, second = cameras
    number = tracks.counts.shape[0]
    landmarks, columns = np.empty(number, dtype=np.int64), np.empty((5, number))
    count = 0
    for k in range(number):
        samples = samples_of(tracks, k, first), samples_of(tracks, k, second)
        counts = tracks.counts[k, first], tracks.counts[k, second]
        newest = _newest_error(rotations, samples, counts, shift_s, period_s)
        if newest[0] and newest[1] != compared_s[k]:
            compared_s[k] = newest[1]
            landmarks[count] = k
            for i, value in enumerate(newest[1:]):
                columns[i, count] = value
            count += 1
    times_s, heights, speeds, spans_s, variances = columns[:, :count]
    return landmarks[:count], times_s, heights, speeds, spans_s, variances


@njit(cache=True)
def _newest_error(
    rotations: tuple[Array, Array],
    samples: tuple[RaySamples, RaySamples],
    counts: tuple[int, int],
    shift_s: float,
    period_s: float,
) -> tuple[bool, float, float, float, float, float]:
    """A landmark's row of EpipolarErrors, from its time on; before it whether there is one."""
    R_first, R_second = rotations
    times_s, rays, sigmas = samples[0]
    ray, bend = np.empty(2), np.empty(2)
    for k in range(counts[0] - 2, max(counts[0] - _NEWEST, 0), -1):
        time_s = times_s[k]
        number, other_sigma = interpolate(
            samples[1], counts[1], time_s + shift_s, period_s, _REACH, ray, bend
        )
        # The error of a parabola through three points is proportional to the speed of a swinging
        # hand: it would pass for a late clock.
        if number < 4:
            continue
        span_s = times_s[k + 1] - times_s[k - 1]
        if abs(times_s[k + 1] + times_s[k - 1] - 2.0 * time_s) > _UNEVEN * span_s:
            continue
        before, after = rectify_ray(R_first, rays[k - 1])[1], rectify_ray(R_first, rays[k + 1])[1]
        speed = (after - before) / span_s
        speed_sigma = math.hypot(sigmas[k + 1], sigmas[k - 1]) / span_s
        now = rectify_ray(R_second, ray)[1]
        missed = rectify_ray(R_second, ray + bend)[1] - now
        return (
            True,
            time_s,
            rectify_ray(R_first, rays[k])[1] - now,
            speed if abs(speed) > _MOVING * speed_sigma else 0.0,
            span_s,
            sigmas[k] ** 2 + other_sigma**2 + (_MISSED * missed) ** 2,
        )
    return False, 0.0, 0.0, 0.0, 0.0, 0.0
