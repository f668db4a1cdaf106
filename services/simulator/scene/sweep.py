"""A tracked object, moved and turned through the cameras' volume as `rhot calibrate objects` wants
it. Pure.

The path is that of the bead on the tracker, so that it stays in all pictures: one sine along each
axis and one about it, at frequencies that have no common measure. Twice continuously
differentiable; time may be any real number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import (
    Array,
    inverse,
    rotation_x,
    rotation_y,
    rotation_z,
    transform,
)
from services.simulator.hands.gestures import TAU
from services.simulator.scene.catalog import SweepSpec

# Of the path and of the turns, Hz. In 20 s each axis comes to both its ends more than twice, at
# 0.2 m/s and 60 deg/s on the average.
_PATH_HZ, _TURN_HZ = np.array([0.13, 0.19, 0.11]), np.array([0.17, 0.23, 0.29])
# Each seed has frequencies of its own, within this share.
_VARIATION = 0.12
# The tracker's top, where its bead is, faces the cameras.
_FACING = rotation_x(np.pi)


@dataclass(frozen=True, eq=False)
class Sweep:
    """One object's way; T_tracker_from_object (4, 4), bead_m (3,) in the tracker's frame."""

    spec: SweepSpec
    T_rig_from_view: Array  # (4, 4), between the cameras
    T_tracker_from_object: Array  # (4, 4)
    bead_m: Array  # (3,)
    omega: Array  # (2, 3) of path and turns, rad/s
    phase: Array  # (2, 3)

    def pose(self, t_s: float) -> Array:
        """T_rig_from_object (4, 4)."""
        (x, y, z), turns = np.sin(self.omega * t_s + self.phase)
        near_m, far_m = self.spec.depth_m
        depth_m = 0.5 * (near_m + far_m) + 0.5 * (far_m - near_m) * z
        # The pictures' edges are further out where it is further away.
        bead_m = depth_m * np.array([self.spec.reach[0] * x, self.spec.reach[1] * y, 1.0])
        about_x, about_y, about_z = np.deg2rad(self.spec.turn_deg) * turns
        rotation = _FACING @ rotation_x(about_x) @ rotation_y(about_y) @ rotation_z(about_z)
        T_view_from_tracker = transform(rotation, bead_m - rotation @ self.bead_m)
        return np.asarray(self.T_rig_from_view @ T_view_from_tracker @ self.T_tracker_from_object)


def sweep(
    spec: SweepSpec, T_rig_from_view: Array, T_object_from_tracker: Array, bead_m: Array, seed: int
) -> Sweep:
    """The way of an object whose tracker sits at T_object_from_tracker (4, 4)."""
    rng = np.random.default_rng([seed, 31])
    varied = rng.uniform(1.0 - _VARIATION, 1.0 + _VARIATION, (2, 3))
    return Sweep(
        spec=spec,
        T_rig_from_view=T_rig_from_view,
        T_tracker_from_object=inverse(T_object_from_tracker),
        bead_m=bead_m,
        omega=TAU * varied * np.stack([_PATH_HZ, _TURN_HZ]),
        phase=rng.uniform(0.0, TAU, (2, 3)),
    )
