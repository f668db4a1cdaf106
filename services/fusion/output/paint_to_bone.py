"""From the visible centre of paint to the point on the bone axis that stands for the landmark.

Cameras see paint on skin, but what they locate is not a point of the skin. The centroid of a
painted finger tip is set by its outline: where that is the limb of the finger, it passes through
the axis as seen from any camera, so two cameras put the centroid *on the axis*; only the edge where
the paint ends lies on the skin itself. Ray-cast from two cameras 75 mm apart (capsule of radius 6.8
mm painted over 14 mm, 400 random directions, the finger not pointing away), the located centroid
against the middle of the painted axis is

    along the viewing ray, away from the cameras   -.5 +- 2.0 mm (within .1 mm alike at .35, .5 and .8 m, and with shading)
        finger along the baseline -2.4 mm, across it -.1 mm, pointing at the cameras +2.1 mm
    across the ray                                 1.5 mm RMS

so there is nothing to push: a push by the radius would be 6.3 mm wrong. What depends on the
finger's direction is taken off when a pose tells it (patch.py; on rendered scenes the RMS error
fell from .49, 1.17, 1.75 to .23, .35, .91 mm along x, y, z); without one it stays, and the
covariance says so. A dab (radius 0) marks the point of the skin under its middle, but skin falls
away from there: the centre of what is seen lies deeper, by `dab_sag_m` against the skin's normal.
What light, background and detector do to a centre is bias.py's matter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import HandModel, HandName
from rhot.messages import HandPose
from services.fusion.geometry.triangulation import extrinsics
from services.fusion.intake.observations import Slot
from services.fusion.method import Bools
from services.fusion.output.paint_centroid import located_shift, shift_table

# What is left along the viewing ray and along each axis across it, in radii of the paint, from the
# figures above.
SIGMA_UNKNOWN = (0.29, 0.16)
# With the solver's directions (7 deg off), along and across: SIDE of a finger seen from the side,
# and END times a power of the cosine between finger and viewing ray beside it. Errors of rendered
# tips at .5-.7 m, all causes: .4-.6 and .13 mm from the side, .7 and .25 at a cosine of -.6,
# 1.4-2.2 and .4-.5 pointing at the cameras, where the visible end depends on the direction most.
# Speed makes no difference.
SIGMA_SIDE = (0.02, 0.012)
SIGMA_END, _END_POWER = (0.25, 0.10), (4, 2)
# Of a dab, in every direction, as a share of its diameter: rendered wrists (16 mm) lie 1.45 mm
# deep, of which their sag explains 1.58.
SIGMA_DAB = 0.025
# A finger turns by up to 10 rad/s: an older direction is worth no more than none.
_POSE_AGE_NS = 150_000_000


def dab_sag_m(radius_m: float, limb_m: float) -> float:
    """How deep under its highest point two cameras locate a dab of radius_m, on skin that curves
    both ways with limb_m as at a joint.

    Each camera weighs the skin by how much it faces it, so the centre of a cap moves from view to
    view as the middle of its *rim* does: from a direction t off the axis, a cap of half-angle p on
    a ball R has its centre at R cos(p) sin(t) beside the ball's. On a cylinder it is 3/4 of that
    deep. 0 for a limb of no thickness.
    """
    return limb_m - math.sqrt(limb_m**2 - radius_m**2) if limb_m > radius_m else 0.0


class Surface:
    """What is known of the paint of every landmark, and of the way the fingers point."""

    def __init__(
        self,
        slots: tuple[Slot, ...],
        hands: Mapping[HandName, HandModel],
        cameras: tuple[Camera, ...],
    ) -> None:
        paints = [hands[slot.hand].paint[slot.landmark] for slot in slots]
        self._slots = slots
        self._radii_m = np.array([paint.radius_m for paint in paints])
        self._dabs_m = np.array(
            [paint.extent_m if paint.radius_m == 0.0 else 0.0 for paint in paints]
        )
        # Which landmarks are paint of some size (S,), not points.
        self.extended: Bools = np.array(
            [paint.radius_m > 0.0 or paint.extent_m > 0.0 for paint in paints], dtype=bool
        )
        offsets = np.array([paint.offset_m for paint in paints]).reshape(-1, 3)
        limbs_m = np.linalg.norm(offsets, axis=1)
        # Outward normal of a dab's skin in its joint's frame (S, 3), and how deep its middle lies
        # under the landmark.
        self._normals = offsets / np.maximum(limbs_m, 1e-9)[:, None]
        self._sags_m = np.array(
            [
                dab_sag_m(0.5 * dab_m, limb_m)
                for dab_m, limb_m in zip(self._dabs_m, limbs_m, strict=True)
            ]
        )
        self._tables = [shift_table(paint.radius_m, paint.extent_m) for paint in paints]
        self._R, self._t = extrinsics(cameras)
        self._eye_rig = np.mean([camera.centre_rig for camera in cameras], axis=0)
        self.forget()

    def forget(self) -> None:
        """Time starts anew: no direction is known."""
        self._directions = np.zeros((len(self._slots), 3))
        self._stamps_ns = [-_POSE_AGE_NS - 1] * len(self._slots)

    def note(self, pose: HandPose) -> None:
        """Remember which way the fingers of a solved hand point, -z of each joint, and which way
        the skin under a dab faces.
        """
        joints = {joint.name: joint for joint in pose.joints if joint.source != "predicted"}
        for row, slot in enumerate(self._slots):
            joint = joints.get(slot.landmark)
            if slot.hand != pose.hand or joint is None or not self.extended[row]:
                continue
            quaternion = np.array(joint.orientation_wxyz)
            if 0.4 < np.abs(quaternion).max() < 1.1:
                R = rotation_from_quaternion(quaternion)
                self._directions[row] = (
                    -R[:, 2] if self._radii_m[row] > 0.0 else R @ self._normals[row]
                )
                self._stamps_ns[row] = pose.stamp_ns

    def to_axis(
        self, positions_m: Array, covariances_m2: Array, seen_by: Bools, instant_ns: int
    ) -> tuple[Array, Array]:
        """Landmarks (S, 3) and covariances (S, 3, 3) from located paint centres.

        seen_by (S, C) tells which cameras located them.
        """
        away = positions_m - self._eye_rig
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)  # (S, 3)
        # Skin that a camera sees faces it, more or less.
        positions = positions_m - self._sags_m[:, None] * away
        sigmas = np.tile(SIGMA_UNKNOWN, (len(positions), 1))
        shift = np.zeros(3)
        for row, stamp_ns in enumerate(self._stamps_ns):
            if abs(instant_ns - stamp_ns) > _POSE_AGE_NS:
                continue
            if self._radii_m[row] == 0.0:
                positions[row] = positions_m[row] + self._sags_m[row] * self._directions[row]
                continue
            by = seen_by[row] if np.count_nonzero(seen_by[row]) >= 2 else np.ones_like(seen_by[row])
            if located_shift(
                self._tables[row],
                positions_m[row],
                self._directions[row],
                self._R[by],
                self._t[by],
                shift,
            ):
                positions[row] -= shift
                cosine = float(away[row] @ self._directions[row])
                sigmas[row] = [
                    np.hypot(a, b * cosine**n)
                    for a, b, n in zip(SIGMA_SIDE, SIGMA_END, _END_POWER, strict=True)
                ]
        along = away[:, :, None] * away[:, None, :]  # (S, 3, 3)
        variances = (sigmas * self._radii_m[:, None]) ** 2 + (
            SIGMA_DAB * self._dabs_m[:, None]
        ) ** 2  # (S, 2)
        blur = variances[:, 0, None, None] * along + variances[:, 1, None, None] * (
            np.eye(3) - along
        )
        return positions, covariances_m2 + blur
