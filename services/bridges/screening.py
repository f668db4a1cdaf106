"""Which messages may go out: what a program gets must be numbers that it can work with. Pure.

A message that decodes may still say that a hand is 1e300 m away, or turned by a quaternion of
length zero: other programs' structs hold 32 bits, and their mathematics no such turn.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from rhot.geometry.transforms import Array
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose

# Farther than any rig sees, faster than anything that is held, more than joints turn.
_MAX_M, _MAX_SPEED, _MAX_RAD = 100.0, 1000.0, 10.0
# Of a quaternion's length squared, which is 1 but for rounding.
_LENGTHS = (0.9, 1.1)


def hand_is_plausible(pose: HandPose) -> bool:
    """Whether every number of a hand is one that a hand can have."""
    wrist = pose.wrist
    return (
        _small(pose.positions_m, _MAX_M)
        and _small(wrist.position_m, _MAX_M)
        and _turns(np.array([*(j.orientation_wxyz for j in pose.joints), wrist.orientation_wxyz]))
        and _small(pose.angles_rad, _MAX_RAD)
    )


def object_is_plausible(pose: ObjectPose) -> bool:
    """The same of an object."""
    return (
        _small(pose.position_m, _MAX_M)
        and _turns(np.array([pose.orientation_wxyz]))
        and _small((*pose.velocity_m_s, *pose.angular_velocity_rad_s), _MAX_SPEED)
    )


def _small(values: Array | Iterable[float], most: float) -> bool:
    return bool(np.all(np.abs(np.asarray(values)) <= most))


def _turns(wxyz: Array) -> bool:
    """Whether these (n, 4) are rotations."""
    if not _small(wxyz, 2.0):
        return False
    lengths = np.einsum("ij,ij->i", wxyz, wxyz)
    low, high = _LENGTHS
    return bool(np.all((lengths > low) & (lengths < high)))
