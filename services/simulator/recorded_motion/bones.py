"""A hand model with the bones of a recording, and how it moves in it. Pure.

Bone lengths and knuckles are the recording's means. The axes of a digit at zero angles follow from
the recording's own angles, or else from its axes of flexion: all lie in one plane, whose normal is
the axis of abduction. Angles are then a closed form: abduction turns the chain's plane, flexions
are angles in it. A recording without a wrist gets it where the hand of the tables, as large, has it
below its knuckles.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

from rhot.geometry.transforms import Array, quaternion_from_rotation, rotation_from_quaternion
from rhot.hand import Digit, HandModel, HandName, default_hand
from services.simulator.recorded_motion.recording import RecordedJoints, RecordedPoints

# HandModel.origin of these hands.
RECORDED = "recorded"
# Bones and knuckles that vary by more than this (standard deviation) are no bones. The Leap
# recordings' vary by 0.3 um; those of tracked poses by what their numbers are rounded to.
_RIGID_M = 1e-3
# How much the tables count against one frame with bones at right angles, where a recording does
# not say how a digit's axes lie.
_TABLE_WEIGHT = 1e-6


@dataclass(frozen=True, eq=False)
class DrivenHand:
    """A model and what it does: it is the truth of what is rendered of it.

    gap_m is how far its tips are from the recording's.
    """

    model: HandModel
    times_s: Array  # (n,)
    wrist_m: Array  # (n, 3)
    rotations: Array  # (n, 3, 3)
    angles_rad: Array  # (n, 5, 4)
    gap_m: Array  # (n, 5)

    @property
    def hand(self) -> HandName:
        return self.model.hand

    def points(self) -> RecordedPoints:
        """Wrist and tips alone, as the model has them."""
        local = _local_joints(self.model, self.angles_rad)[:, :, 3]
        tips = np.einsum("nij,nfj->nfi", self.rotations, local) + self.wrist_m[:, None]
        points = np.concatenate([self.wrist_m[:, None], tips], axis=1)
        return RecordedPoints(self.hand, self.times_s, points)


def driven_hand(recorded: RecordedJoints) -> DrivenHand | RecordedPoints:
    """The hand that moves as the recording does; its points alone if no rigid bones fit them."""
    local = np.einsum(
        "nji,nfkj->nfki", recorded.axes, recorded.joints_m - recorded.origin_m[:, None, None]
    )
    bones = np.diff(local, axis=2)  # (n, 5, 3, 3)
    lengths = np.linalg.norm(bones, axis=3)
    knuckles = local[:, :, 0]
    if max(lengths.std(axis=0).max(), knuckles.std(axis=0).max()) > _RIGID_M:
        points = np.concatenate([recorded.origin_m[:, None], recorded.joints_m[:, :, 3]], axis=1)
        return RecordedPoints(recorded.hand, recorded.times_s, points)
    size = float(lengths[:, 1:].mean() / default_hand(recorded.hand).lengths_m[1:].mean())
    table, wrist = default_hand(recorded.hand, size), np.zeros(3)
    if not recorded.is_wrist:
        wrist = (knuckles.mean(axis=0) - [digit.base_m for digit in table.digits]).mean(axis=0)
    directions = bones / np.maximum(lengths[..., None], 1e-9)
    digits, angles = [], []
    for row, digit in enumerate(table.digits):
        own = None if recorded.angles_rad is None else recorded.angles_rad[:, row]
        base = _base_rotation(digit, directions[:, row], own, table.side)
        if own is None:
            own = _angles(directions[:, row] @ base, table.side)
        angles.append(own)
        digits.append(_digit(digit, knuckles[:, row].mean(axis=0) - wrist, base, own))
        digits[-1] = msgspec.structs.replace(
            digits[-1], lengths_m=tuple(lengths[:, row].mean(axis=0).tolist())
        )
    model = msgspec.structs.replace(table, digits=tuple(digits), origin=RECORDED)
    angles_rad = np.stack(angles, axis=1)
    found = _local_joints(model, angles_rad)[:, :, 3] + wrist
    return DrivenHand(
        model=model,
        times_s=recorded.times_s,
        wrist_m=recorded.origin_m + recorded.axes @ wrist,
        rotations=recorded.axes,
        angles_rad=angles_rad,
        gap_m=np.linalg.norm(found - local[:, :, 3], axis=2),
    )


def _base_rotation(digit: Digit, bones: Array, angles_rad: Array | None, side: float) -> Array:
    """Axes of a digit's first bone at zero angles (3, 3) in the wrist frame.

    bones (n, 3, 3) are directions in the wrist frame, angles_rad (n, 4) the recording's own.
    """
    table = rotation_from_quaternion(digit.base_wxyz)
    if angles_rad is not None:
        # Kabsch: what turns the directions at these angles into those recorded.
        turned = np.einsum("nki,nkj->ij", bones, _directions(angles_rad, side))
        u, _, vt = np.linalg.svd(turned + _TABLE_WEIGHT * len(bones) * table)
        u[:, 2] *= np.linalg.det(u @ vt)
        return np.asarray(u @ vt)
    # The cross product is long where the digit is bent, and says something of the axis only there.
    axes = np.concatenate([np.cross(bones[:, k], bones[:, k + 1]) for k in (0, 1)])
    spread = axes.T @ axes + _TABLE_WEIGHT * len(axes) * (
        np.eye(3) - np.outer(table[:, 1], table[:, 1])
    )
    y = np.linalg.eigh(spread)[1][:, 0]
    y *= np.sign(y @ table[:, 1])
    x = table[:, 0] - (table[:, 0] @ y) * y
    x /= np.linalg.norm(x)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _angles(bones: Array, side: float) -> Array:
    """Angles (n, 4) of a chain with these directions (n, 3, 3) in its base frame.

    The chain's plane is the one that the three bones leave least (squares of the distances).
    """
    x, down, z = bones[..., 0], -bones[..., 1], bones[..., 2]
    # A chain that points straight down has any abduction: none, then.
    turn = 0.5 * np.arctan2(2.0 * (x * z).sum(axis=1), (z * z - x * x).sum(axis=1) + 1e-9)
    ahead = -(np.sin(turn)[:, None] * x + np.cos(turn)[:, None] * z)
    absolute = np.unwrap(np.arctan2(down, ahead), axis=1)
    return np.column_stack([side * turn, absolute[:, 0], np.diff(absolute, axis=1)])


def _directions(angles_rad: Array, side: float) -> Array:
    """Directions (n, 3, 3) of the three bones in the base frame at angles (n, 4)."""
    turn, flexion = side * angles_rad[:, :1], np.cumsum(angles_rad[:, 1:], axis=1)
    ahead = np.cos(flexion)
    return np.stack([-np.sin(turn) * ahead, -np.sin(flexion), -np.cos(turn) * ahead], axis=2)


def _local_joints(model: HandModel, angles_rad: Array) -> Array:
    """Joints (n, 5, 4, 3) in the wrist frame at angles (n, 5, 4), as rhot.hand.forward has them."""
    chains = []
    for row, digit in enumerate(model.digits):
        base = rotation_from_quaternion(digit.base_wxyz)
        bones = _directions(angles_rad[:, row], model.side) @ base.T
        steps = np.cumsum(bones * np.array(digit.lengths_m)[:, None], axis=1)
        root = np.zeros((len(steps), 1, 3))
        chains.append(np.array(digit.base_m) + np.concatenate([root, steps], axis=1))
    return np.stack(chains, axis=1)


def _digit(table: Digit, base_m: Array, base: Array, angles_rad: Array) -> Digit:
    """A digit with limits that allow what was recorded, and whose DIP follows PIP as it did."""
    limits = np.array(table.limits_rad)
    low = np.minimum(limits[:, 0], angles_rad.min(axis=0))
    high = np.maximum(limits[:, 1], angles_rad.max(axis=0))
    bent = angles_rad[:, 2]
    followed = float(np.clip(angles_rad[:, 3] @ bent / max(float(bent @ bent), 1e-9), 0.0, 1.5))
    return msgspec.structs.replace(
        table,
        base_m=tuple(base_m.tolist()),
        base_wxyz=tuple(quaternion_from_rotation(base).tolist()),
        limits_rad=tuple(zip(low.tolist(), high.tolist(), strict=True)),
        coupling=followed,
    )
