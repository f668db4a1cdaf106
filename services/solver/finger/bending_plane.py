"""A digit in its plane of bending: a planar chain of three bones.

Abduction turns the plane onto a target, then the three bones bend in it. Coordinates in the plane:
forward (-z of the canonical frame) and palmar (-y), both in the chain's unit of length. The third
bone ends in the painted point; `gamma` is the angle by which that point is off the bone's axis. For
the methods that solve a plane problem: FABRIK and the closed form.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.chains import Chain


class BendingPlane(NamedTuple):
    """The chain in its plane."""

    bones: Array  # (3,) lengths, the last one to the painted point
    gamma: float  # rad
    limits: Array  # (4, 2) rad, as in Chain
    coupling: Array  # (2,) as in Chain


@njit(cache=True)
def bending_plane(chain: Chain) -> BendingPlane:
    """The plane of a chain."""
    last = math.hypot(chain.tool[1], chain.tool[2])
    bones = np.array([chain.lengths[0], chain.lengths[1], last])
    gamma = math.atan2(-chain.tool[1], -chain.tool[2])
    return BendingPlane(bones, gamma, chain.limits, chain.coupling)


@njit(cache=True)
def planar_tip(
    plane: BendingPlane, first: float, second: float, last: float
) -> tuple[float, float]:
    """Forward kinematics in the plane: forward and palmar of the painted point.

    Of the three flexions (rad). Proven to agree with kinematics.tip_position by a test.
    """
    a, b, c = plane.bones
    angle2, angle3 = first + second, first + second + last + plane.gamma
    x = a * math.cos(first) + b * math.cos(angle2) + c * math.cos(angle3)
    return x, a * math.sin(first) + b * math.sin(angle2) + c * math.sin(angle3)


@njit(cache=True)
def wrap_angle(angle: float) -> float:
    """The same angle within -pi..pi."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(cache=True)
def clamp_angle(angle: float, low: float, high: float) -> float:
    """An angle within low..high; from outside, the end that is nearer around the circle."""
    angle = wrap_angle(angle)
    if low <= angle <= high:
        return angle
    return low if abs(wrap_angle(angle - low)) < abs(wrap_angle(angle - high)) else high


@njit(cache=True)
def abduction_towards(
    target: Array, tool_x: float, branch: int, current: float, limits: Array
) -> float:
    """Abduction that brings target (3,) into the chain's plane, within limits (2,).

    branch +1: the tip is in front of the knuckle, -1: behind it (a tight fist). A target on the
    axis of abduction says nothing of it: then it stays `current`.
    """
    low, high = limits[0], limits[1]
    depth = math.sqrt(max(target[0] ** 2 + target[2] ** 2 - tool_x**2, 0.0))
    if depth < 1e-6:
        return min(max(current, low), high)
    angle = wrap_angle(math.atan2(target[0], target[2]) - math.atan2(tool_x, -branch * depth))
    return min(max(angle, low), high)


@njit(cache=True)
def forward_coordinate(target: Array, abduction: float) -> float:
    """How far forward target (3,) is in the plane at that abduction.

    Its palmar coordinate there is -target[1].
    """
    return -(math.sin(abduction) * target[0] + math.cos(abduction) * target[2])
