"""A digit seen in its own plane: abduction turns the plane onto a target, then three bones bend in
it.

Coordinates in the plane: forward (-z of the canonical frame) and palm (-y), both with the digit's
length as the unit. The third bone ends in the painted point; `gamma` is the angle by which that
point is off the bone's axis. Pure maths.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.kinematics import Chain


class Plane(NamedTuple):
    """The chain in its plane."""

    bones: Array  # (3,)
    gamma: float  # rad
    limits: Array  # (4, 2) rad, as in Chain
    coupling: Array  # (2,)


@njit(cache=True)
def plane_of(unit: Chain) -> Plane:
    """The plane of a chain whose length is 1."""
    bones = np.array([unit.lengths[0], unit.lengths[1], math.hypot(unit.tool[1], unit.tool[2])])
    return Plane(bones, math.atan2(-unit.tool[1], -unit.tool[2]), unit.limits, unit.coupling)


@njit(cache=True)
def wrapped(angle: float) -> float:
    """The same angle within -pi..pi."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(cache=True)
def limited(angle: float, low: float, high: float) -> float:
    """An angle within low..high; from outside, the end that is nearer around the circle."""
    angle = wrapped(angle)
    if low <= angle <= high:
        return angle
    return low if abs(wrapped(angle - low)) < abs(wrapped(angle - high)) else high


@njit(cache=True)
def facing(
    target: Array, tool_x: float, branch: int, before: float, low: float, high: float
) -> float:
    """Abduction that brings target (3,) into the chain's plane, within low..high.

    branch +1: the tip is in front of the knuckle, -1: behind it (a tight fist). A target on the
    axis of abduction says nothing of it: then it stays as it was `before`.
    """
    depth = math.sqrt(max(target[0] ** 2 + target[2] ** 2 - tool_x**2, 0.0))
    if depth < 1e-6:
        return min(max(before, low), high)
    angle = wrapped(math.atan2(target[0], target[2]) - math.atan2(tool_x, -branch * depth))
    return min(max(angle, low), high)


@njit(cache=True)
def forward_of(target: Array, abduction: float) -> float:
    """How far forward target (3,) is in the plane at that abduction.

    Its other coordinate there is -target[1].
    """
    return -(math.sin(abduction) * target[0] + math.cos(abduction) * target[2])
