"""The height difference of one landmark between two cameras at one instant: an epipolar residual.

Heights are y/z in the rectified frame of the pair, alike for both cameras if they are calibrated
and their clocks agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rhot.geometry.transforms import Array
from services.fusion.geometry.rectified_pair import RectifiedPair, rectify_ray
from services.fusion.intake.ray_interpolation import RayTrack

# A landmark moves if its speed is this many times its uncertainty (1.6 sigma per frame time for the
# cubic's slope).
_MOVING = 8.0
# Half the step of the numerical speed: short against a frame.
_STEP_S = 1e-3
# How many of the first camera's newest samples are tried.
_NEWEST = 4


@dataclass(frozen=True)
class EpipolarError:
    """One landmark's height in the first camera minus that in the second; normalised units."""

    height: float
    speed: float  # 1/s, of the height in the second camera; 0 if it is not known to move
    variance: float  # of the height difference


def epipolar_error(
    pair: RectifiedPair, first: RayTrack, second: RayTrack, shift_s: float, period_s: float
) -> EpipolarError | None:
    """The newest height difference that both tracks of a landmark give; None if they give none.

    shift_s is how much later the second camera's clock reads than the first's, period_s the second
    camera's frame time.
    """
    for time_s, ray, sigma in first.newest(_NEWEST):
        around = [
            second.at(time_s + shift_s + step_s, "hermite", period_s)
            for step_s in (-_STEP_S, 0.0, _STEP_S)
        ]
        # The error of a parabola through three points is proportional to the speed of a swinging
        # hand: it would pass for a late clock.
        full = [other for other in around if other is not None and other.samples == 4]
        if len(full) < 3:
            continue
        before, now, after = (_height(pair.R_rectified_from_second, other.ray) for other in full)
        speed = (after - before) / (2.0 * _STEP_S)
        # Speed that is but noise shares that noise with the height, and would look like a clock
        # error of about half a frame.
        moving = abs(speed) > _MOVING * full[1].sigma / period_s
        return EpipolarError(
            height=_height(pair.R_rectified_from_first, ray) - now,
            speed=speed if moving else 0.0,
            variance=sigma**2 + full[1].sigma ** 2,
        )
    return None


def _height(R_rectified_from_camera: Array, ray: Array) -> float:
    """y/z of a ray (2,) in the rectified frame; infinite if it points backwards."""
    rectified = rectify_ray(R_rectified_from_camera, ray)
    return math.inf if rectified is None else float(rectified[1])
