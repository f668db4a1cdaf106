"""A hand's motion as animation programs want it: a skeleton with fixed bones, at a constant rate.

Poses come at their cameras' instants. Here they are put on an even grid of their median spacing:
the wrist's position in between linearly, rotations along the shortest way (slerp), so that bones
keep their lengths. Longer gaps are bridged the same way, and counted. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.geometry.up_axes import UPS
from rhot.hand import HANDS, JOINT_INDEX, JOINTS, HandName
from rhot.hand_mesh.skinned_hand import PARENTS, SKIN_JOINTS
from rhot.messages import HandPose

# A break in the sequence of poses that is worth a word.
_GAP_S = 0.5
# Cameras of 1 to 1000 pictures a second.
_RATES_HZ = (1.0, 1000.0)


@dataclass(frozen=True)
class Clip:
    """One hand's motion, (n,) frames at rate_hz from the recording's time start_s on; y is up.

    offsets_m (25, 3): each joint of SKIN_JOINTS in its parent's frame, constant; the wrist's is 0.
    """

    hand: HandName
    rate_hz: float
    start_s: float
    wrist_m: Array  # (n, 3)
    rotations: Array  # (n, 26, 3, 3) of JOINTS
    offsets_m: Array
    angles_rad: Array  # (n, 5, 4)
    gaps: int

    @property
    def times_s(self) -> Array:
        """(n,) from the recording's first message on."""
        return self.start_s + np.arange(len(self.wrist_m)) / self.rate_hz

    def positions_m(self) -> Array:
        """All joints but the palm, (n, 25, 3): forward kinematics of what is exported."""
        positions = np.empty((len(self.wrist_m), len(SKIN_JOINTS), 3))
        for j, name in enumerate(SKIN_JOINTS):
            parent = PARENTS[name]
            if parent is None:
                positions[:, j] = self.wrist_m
                continue
            p = JOINT_INDEX[parent]
            positions[:, j] = positions[:, p - 1] + self.rotations[:, p] @ self.offsets_m[j]
        return positions


def clips(poses: Iterable[HandPose], up: str, origin_ns: int) -> list[Clip]:
    """A clip of each hand that has two poses or more; times from origin_ns on.

    up is a key of UPS. Raises CaptureError if there is none.
    """
    by_hand: dict[HandName, list[HandPose]] = {hand: [] for hand in HANDS}
    for pose in poses:
        kept = by_hand[pose.hand]
        if not kept or pose.stamp_ns > kept[-1].stamp_ns:
            kept.append(pose)
    found = [_clip(kept, UPS[up], origin_ns) for kept in by_hand.values() if len(kept) >= 2]
    if not found:
        raise CaptureError("has no motion of a hand: it takes two poses at least")
    return found


def _clip(poses: Sequence[HandPose], turn: Array, origin_ns: int) -> Clip:
    seconds = np.array([(pose.stamp_ns - origin_ns) * 1e-9 for pose in poses])
    steps = np.diff(seconds)
    rate_hz = round(float(np.clip(1.0 / np.median(steps), *_RATES_HZ)), 3)
    count = int((seconds[-1] - seconds[0]) * rate_hz + 1e-6) + 1
    grid = np.minimum(seconds[0] + np.arange(count) / rate_hz, seconds[-1])
    positions = np.array([pose.positions_m for pose in poses]) @ turn.T
    wxyz = np.array([pose.orientations_wxyz for pose in poses])
    rotations = np.empty((count, len(JOINTS), 3, 3))
    given = np.empty((len(poses), len(JOINTS), 3, 3))
    for j in range(len(JOINTS)):
        track = Rotation.from_matrix(turn) * Rotation.from_quat(wxyz[:, j][:, [1, 2, 3, 0]])
        given[:, j] = track.as_matrix()
        rotations[:, j] = Slerp(seconds, track)(grid).as_matrix()
    angles = np.array([pose.angles_rad for pose in poses]).reshape(len(poses), 20)
    return Clip(
        hand=poses[0].hand,
        rate_hz=rate_hz,
        start_s=float(seconds[0]),
        wrist_m=_interpolated(grid, seconds, positions[:, JOINT_INDEX["wrist"]]),
        rotations=rotations,
        offsets_m=_offsets(positions, given),
        angles_rad=_interpolated(grid, seconds, angles).reshape(count, 5, 4),
        gaps=int(np.sum(steps > _GAP_S)),
    )


def _offsets(positions: Array, rotations: Array) -> Array:
    """The median, over all poses, of each joint in its parent's frame (25, 3)."""
    offsets = np.zeros((len(SKIN_JOINTS), 3))
    for j, name in enumerate(SKIN_JOINTS):
        parent = PARENTS[name]
        if parent is not None:
            a, b = JOINT_INDEX[parent], JOINT_INDEX[name]
            bone = np.einsum("nji,nj->ni", rotations[:, a], positions[:, b] - positions[:, a])
            offsets[j] = np.median(bone, axis=0)
    return offsets


def _interpolated(grid: Array, seconds: Array, values: Array) -> Array:
    """Columns of values (n, k) at the grid's times (m,), linearly; (m, k)."""
    return np.stack([np.interp(grid, seconds, column) for column in values.T], axis=1)
