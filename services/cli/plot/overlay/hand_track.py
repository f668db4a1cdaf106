"""The hands of a result at any instant, read pose after pose. Pure.

Poses come at the instants of one camera's frames; another camera's pictures lie between them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HANDS, HandName
from rhot.messages import HandPose


@dataclass(frozen=True, eq=False)
class ShownHand:
    """One hand at one instant.

    angles_rad as a HandModel has them; pose is the nearest one, whose sources and statuses hold.
    """

    hand: HandName
    joints_m: Array  # (26, 3)
    angles_rad: Array  # (5, 4)
    pose: HandPose


class HandTrack:
    """Poses in the order of time; what lies further back than `reach` is forgotten."""

    def __init__(self, poses: Iterable[HandPose], reach_ns: float) -> None:
        """reach_ns: two poses that lie further apart have a gap between them, without a hand."""
        self._poses: Iterator[HandPose] = iter(poses)
        self._reach_ns = reach_ns
        self._near: deque[HandPose] = deque()

    def at(self, stamp_ns: int) -> list[ShownHand]:
        """Every hand that has a pose then: between two, linearly; at an end, the last one for half
        the reach. To be asked in the order of time.
        """
        while not self._near or self._near[-1].stamp_ns <= stamp_ns + self._reach_ns:
            pose = next(self._poses, None)
            if pose is None:
                break
            self._near.append(pose)
        while self._near and self._near[0].stamp_ns < stamp_ns - self._reach_ns:
            self._near.popleft()
        shown = (self._hand_at(hand, stamp_ns) for hand in HANDS)
        return [hand for hand in shown if hand is not None]

    def _hand_at(self, hand: HandName, stamp_ns: int) -> ShownHand | None:
        own = [pose for pose in self._near if pose.hand == hand]
        before = max(
            (pose for pose in own if pose.stamp_ns <= stamp_ns),
            key=lambda pose: pose.stamp_ns,
            default=None,
        )
        after = min(
            (pose for pose in own if pose.stamp_ns >= stamp_ns),
            key=lambda pose: pose.stamp_ns,
            default=None,
        )
        if before and after and after.stamp_ns - before.stamp_ns <= self._reach_ns:
            gap_ns = after.stamp_ns - before.stamp_ns
            share = (stamp_ns - before.stamp_ns) / gap_ns if gap_ns else 0.0
            nearest = after if share > 0.5 else before
            joints_m = (1.0 - share) * _joints_m(before) + share * _joints_m(after)
            angles_rad = (1.0 - share) * _angles_rad(before) + share * _angles_rad(after)
            return ShownHand(hand, joints_m, angles_rad, nearest)
        alone = [one for one in (before, after) if one is not None]
        if not alone:
            return None
        nearest = min(alone, key=lambda pose: abs(pose.stamp_ns - stamp_ns))
        if abs(nearest.stamp_ns - stamp_ns) > 0.5 * self._reach_ns:
            return None
        return ShownHand(hand, _joints_m(nearest), _angles_rad(nearest), nearest)


def _joints_m(pose: HandPose) -> Array:
    return np.array([joint.position_m for joint in pose.joints])  # (26, 3)


def _angles_rad(pose: HandPose) -> Array:
    return np.array([finger.model_angles_rad for finger in pose.fingers])  # (5, 4)
