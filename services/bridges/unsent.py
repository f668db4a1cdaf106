"""Which poses of a frame have not been sent yet. Pure.

A frame has all that counts, so that a hand's pose comes again when an object moves; ROS's listeners
complain of transforms that are told twice.
"""

from __future__ import annotations

from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose
from services.bridges.pacing import Frame


class Unsent:
    """Remembers what went out."""

    def __init__(self) -> None:
        self._hands: dict[str, tuple[int, int]] = {}
        self._objects: dict[str, tuple[int, int]] = {}

    def hands(self, frame: Frame) -> list[HandPose]:
        """Hands of the frame that are new."""
        new = [pose for pose in frame.hands.values() if self._hands.get(pose.hand) != _when(pose)]
        self._hands = {pose.hand: _when(pose) for pose in frame.hands.values()}
        return new

    def objects(self, frame: Frame) -> list[ObjectPose]:
        """Objects of the frame that are new."""
        poses = frame.objects.values()
        new = [pose for pose in poses if self._objects.get(pose.object) != _when(pose)]
        self._objects = {pose.object: _when(pose) for pose in poses}
        return new


def _when(pose: HandPose | ObjectPose) -> tuple[int, int]:
    return pose.stamp_ns, pose.seq
