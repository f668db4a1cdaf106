"""The simulator's truth as functions of time: the state of hand and objects at a pose's own stamp.

Truth comes as one line per instant; poses have stamps of their own. Positions are interpolated by a
cubic spline, angles linearly, orientations along the shortest arc. Nothing is extrapolated: an
instant before the first or after the last line is `outside`, and the scores count those. A capture
with fewer than two lines of truth cannot be scored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.hand import DIGIT_ANGLES, DIGITS, TIPS
from rhot.messages import FingerAngles
from rhot.messages.simulator import HandTruth, ObjectTruth, Truth
from services.cli.evaluate.interpolation import Stamps, cubic, linear, slerp


@dataclass(frozen=True, eq=False)
class HandTrack:
    """One hand's truth or estimate at n instants, in the rig frame; metres and radians."""

    stamps_ns: Stamps  # (n,)
    wrist_m: Array  # (n, 3)
    wrist_wxyz: Array  # (n, 4)
    tips_m: Array  # (n, 5, 3), in the order of DIGITS
    angles_rad: Array  # (n, 5, 4), in the order of DIGIT_ANGLES

    def at(self, stamps_ns: Stamps) -> HandTrack:
        """The hand at other instants (m,), all of them inside the span of the truth."""
        return HandTrack(
            stamps_ns,
            cubic(self.stamps_ns, self.wrist_m, stamps_ns),
            slerp(self.stamps_ns, self.wrist_wxyz, stamps_ns),
            cubic(self.stamps_ns, self.tips_m, stamps_ns),
            linear(self.stamps_ns, self.angles_rad, stamps_ns),
        )


@dataclass(frozen=True, eq=False)
class ObjectTrack:
    """One object's truth or estimate at n instants, in the rig frame."""

    stamps_ns: Stamps  # (n,)
    position_m: Array  # (n, 3)
    orientation_wxyz: Array  # (n, 4)

    def at(self, stamps_ns: Stamps) -> ObjectTrack:
        """The object at other instants (m,), all of them inside the span of the truth."""
        position = cubic(self.stamps_ns, self.position_m, stamps_ns)
        return ObjectTrack(
            stamps_ns, position, slerp(self.stamps_ns, self.orientation_wxyz, stamps_ns)
        )


def hand_track(lines: Sequence[Truth], hand: str) -> HandTrack:
    """The truth of one hand from all lines that hold it.

    Raises CaptureError if fewer than two do.
    """
    found = sorted(
        ((line.stamp_ns, line.hands[hand]) for line in lines if hand in line.hands),
        key=lambda pair: pair[0],
    )
    stamps = _increasing([stamp for stamp, _ in found], f"truth of the {hand} hand")
    hands = [truth for _, truth in found]
    return HandTrack(
        stamps,
        np.array([h.wrist.position_m for h in hands]),
        np.array([h.wrist.orientation_wxyz for h in hands]),
        np.array([_tips(h) for h in hands]),
        np.array([angle_rows([h.angles_rad[digit] for digit in DIGITS]) for h in hands]),
    )


def object_track(lines: Sequence[Truth], name: str) -> ObjectTrack:
    """The truth of one object; raises CaptureError if fewer than two lines hold it."""
    found: list[tuple[int, ObjectTruth]] = [
        (line.stamp_ns, line.objects[name]) for line in lines if name in line.objects
    ]
    found.sort(key=lambda pair: pair[0])
    stamps = _increasing([stamp for stamp, _ in found], f"truth of object {name!r}")
    return ObjectTrack(
        stamps,
        np.array([o.position_m for _, o in found]),
        np.array([o.orientation_wxyz for _, o in found]),
    )


def angle_rows(fingers: Sequence[FingerAngles]) -> Array:
    """(5, 4) in the order of DIGIT_ANGLES from the angles of the five digits."""
    return np.array(
        [
            [getattr(f, joint) for joint in joints]
            for f, joints in zip(fingers, DIGIT_ANGLES, strict=True)
        ]
    )


def inside(track: HandTrack | ObjectTrack, stamps_ns: Stamps) -> npt.NDArray[np.bool_]:
    """Which instants (m,) lie in the span of the truth."""
    return (stamps_ns >= track.stamps_ns[0]) & (stamps_ns <= track.stamps_ns[-1])


def _tips(truth: HandTruth) -> Array:
    missing = [tip for tip in TIPS if tip not in truth.points_m]
    if missing:
        raise CaptureError(
            f"truth.jsonl: points_m lacks {missing}; "
            "simulate the capture again with `rhot simulate`"
        )
    return np.array([truth.points_m[tip] for tip in TIPS])


def _increasing(stamps: list[int], what: str) -> Stamps:
    if len(stamps) < 2:
        raise CaptureError(
            f"{what}: {len(stamps)} line(s) in truth.jsonl; "
            "at least 2 are needed to score against it"
        )
    array = np.array(stamps, dtype=np.int64)
    if np.any(np.diff(array) <= 0):
        raise CaptureError(
            f"{what}: two lines of truth.jsonl have the same stamp_ns; simulate the capture again"
        )
    return array
