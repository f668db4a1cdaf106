"""Where the rig stands in a program with a floor: x right, y up, z backward, metres. Pure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.files.bridge_tables import PlacedBridge
from rhot.geometry.quaternions import Quat, Vec3, multiply, normalized, rotate
from rhot.geometry.transforms import quaternion_from_rotation, rotation_y
from rhot.geometry.up_axes import UPS


class Placement(NamedTuple):
    """The rig's pose in the program's space, right-handed with y up."""

    turn_wxyz: Quat
    origin_m: Vec3

    def point(self, p_rig: Vec3) -> Vec3:
        """A point of the rig, in the program's space; metres."""
        x, y, z = rotate(self.turn_wxyz, p_rig)
        a, b, c = self.origin_m
        return x + a, y + b, z + c

    def orientation(self, q_rig: Quat) -> Quat:
        """An orientation in the rig, in the program's space; wxyz with w >= 0."""
        return normalized(multiply(self.turn_wxyz, q_rig))

    def direction(self, v_rig: Vec3) -> Vec3:
        """A vector that has no origin (a velocity), in the program's space."""
        return rotate(self.turn_wxyz, v_rig)


def placement_of(table: PlacedBridge) -> Placement:
    """What rig.toml says of it."""
    turn = rotation_y(np.deg2rad(table.yaw_deg)) @ UPS[table.up]
    w, x, y, z = quaternion_from_rotation(turn).tolist()
    return Placement((w, x, y, z), table.position_m)
