"""What goes out, and how often: the newest pose of each hand and object, not oftener than asked.
Pure: time is an argument.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

from rhot.hand import HandName
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose

N = TypeVar("N", bound=str)
P = TypeVar("P", HandPose, ObjectPose)

# A hand or object that has not come for so long is lost: seven pictures of a 30 Hz camera, and more
# than any pause between poses of a hand that is seen.
HOLD_S = 0.25
# Names come from the network, memory must not.
_MAX_OBJECTS = 64


class Frame(NamedTuple):
    """What is known at one instant: a hand or object that is lost is not in it.

    time_s counts from the bridge's start.
    """

    time_s: float
    hands: dict[HandName, HandPose]
    objects: dict[str, ObjectPose]


class Newest:
    """The newest pose of each hand and object, for as long as it counts."""

    def __init__(self, start_s: float) -> None:
        self._start_s = start_s
        self._hands: dict[HandName, tuple[float, HandPose]] = {}
        self._objects: dict[str, tuple[float, ObjectPose]] = {}

    def hand(self, pose: HandPose, now_s: float) -> None:
        """A hand's pose arrived."""
        self._hands[pose.hand] = (now_s, pose)

    def object(self, pose: ObjectPose, now_s: float) -> None:
        """An object's pose arrived; one that is lost or not registered does not count."""
        if pose.tracking != "ok" or not pose.registered:
            self._objects.pop(pose.object, None)
        elif pose.object in self._objects or len(self._objects) < _MAX_OBJECTS:
            self._objects[pose.object] = (now_s, pose)

    def frame(self, now_s: float) -> Frame:
        """What counts now."""
        return Frame(
            now_s - self._start_s, _fresh(self._hands, now_s), _fresh(self._objects, now_s)
        )


def _fresh(poses: dict[N, tuple[float, P]], now_s: float) -> dict[N, P]:
    """Those that came within HOLD_S; the others are forgotten."""
    for name in [name for name, (came_s, _) in poses.items() if now_s - came_s > HOLD_S]:
        del poses[name]
    return {name: pose for name, (_, pose) in poses.items()}


class Pacer:
    """Says how long the next frame must wait, so that there are no more than rate_hz a second."""

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._next_s = float("-inf")

    def wait_s(self, now_s: float) -> float:
        """0 if a frame may go out now."""
        return max(0.0, self._next_s - now_s)

    def went(self, now_s: float) -> None:
        """A frame went out.

        The next is due a period after this one was: a frame that was late by less than that does
        not slow the others down.
        """
        self._next_s = max(self._next_s, now_s - self._period_s) + self._period_s
