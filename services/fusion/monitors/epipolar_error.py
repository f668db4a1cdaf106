"""The height difference of one landmark between two cameras at one instant: an epipolar residual.

Heights are y/z in the rectified frame of the pair, alike for both cameras if they are calibrated
and their clocks agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rhot.geometry.transforms import Array
from services.fusion.geometry.rectified_pair import RectifiedPair, rectify_ray
from services.fusion.intake.ray_interpolation import InterpolatedRay, RayTrack

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
# Neighbours of a sample whose distances differ by more than this share do not give its speed.
_UNEVEN = 0.1


@dataclass(frozen=True)
class EpipolarError:
    """One landmark's height in the first camera minus that in the second; normalised units."""

    time_s: float  # of the first camera's sample, by its own clock
    height: float
    speed: float  # 1/s, of the height; 0 if it is not known to move
    span_s: float  # over which the speed was measured
    variance: float  # of the height difference: noise, and what interpolation may miss


def epipolar_error(
    pair: RectifiedPair, first: RayTrack, second: RayTrack, shift_s: float, period_s: float
) -> EpipolarError | None:
    """The newest height difference that both tracks of a landmark give; None if they give none.

    shift_s is how much later the second camera's clock reads than the first's, period_s the second
    camera's frame time.

    The speed is that between the first camera's samples before and after its own. Noise in them
    does not pass for a clock error, however much it is and however it is correlated in time: it is
    another camera's than that of the interpolated height, and lies alike on both sides of the
    sample. (A slope of the same interpolation shares its noise; where that is 2 px, and not the .1
    px that is announced, the difference looks like a clock error of up to half a frame.)
    """
    newest = first.newest(_NEWEST)
    for after, (time_s, ray, sigma), before in zip(newest, newest[1:], newest[2:], strict=False):
        other = second.at(time_s + shift_s, "hermite", period_s)
        # The error of a parabola through three points is proportional to the speed of a swinging
        # hand: it would pass for a late clock.
        if other is None or other.samples < 4:
            continue
        span_s = after[0] - before[0]
        if abs(after[0] + before[0] - 2.0 * time_s) > _UNEVEN * span_s:
            continue
        R = pair.R_rectified_from_first
        speed = (_height(R, after[1]) - _height(R, before[1])) / span_s
        speed_sigma = math.hypot(after[2], before[2]) / span_s
        now, missed = _height_and_bend(pair.R_rectified_from_second, other)
        return EpipolarError(
            time_s=time_s,
            height=_height(R, ray) - now,
            speed=speed if abs(speed) > _MOVING * speed_sigma else 0.0,
            span_s=span_s,
            variance=sigma**2 + other.sigma**2 + (_MISSED * missed) ** 2,
        )
    return None


def _height_and_bend(R_rectified_from_camera: Array, ray: InterpolatedRay) -> tuple[float, float]:
    """The height of an interpolated ray, and by how much its bend would change that."""
    height = _height(R_rectified_from_camera, ray.ray)
    return height, _height(R_rectified_from_camera, ray.ray + ray.bend) - height


def _height(R_rectified_from_camera: Array, ray: Array) -> float:
    """y/z of a ray (2,) in the rectified frame; infinite if it points backwards."""
    rectified = rectify_ray(R_rectified_from_camera, ray)
    return math.inf if rectified is None else float(rectified[1])
