"""The simulator's truth as functions of time: what hand and objects did at the instant a pose
speaks of.

Truth comes as one line per instant; poses have stamps of their own. Positions are interpolated by a
cubic spline, angles linearly, orientations along the shortest arc. Nothing is extrapolated: an
instant before the first or after the last line is `outside`, and the scores say how many those
were. A capture with fewer than two lines of truth cannot be scored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.hand import DIGIT_ANGLES, DIGITS, TIPS
from rhot.messages import FingerAngles
from rhot.simulator_messages import HandTruth, ObjectTruth, Truth

Stamps = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class HandTrack:
    """One hand's truth: stamps_ns (n,), wrist and tips in metres, orientation wxyz, angles (n, 5,
    4) in rad.
    """

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
    """One object's truth or estimate: stamps_ns (n,), position (n, 3) in metres, orientation (n, 4)
    wxyz.
    """

    stamps_ns: Stamps
    position_m: Array
    orientation_wxyz: Array

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


def cubic(stamps_ns: Stamps, values: Array, at_ns: Stamps) -> Array:
    """Cubic spline through (n, ...) at (m,) -> (m, ...)."""
    return np.asarray(
        CubicSpline(_seconds(stamps_ns, stamps_ns), values, axis=0)(_seconds(at_ns, stamps_ns))
    )


def linear(stamps_ns: Stamps, values: Array, at_ns: Stamps) -> Array:
    """Straight lines through (n, ...) at (m,) -> (m, ...)."""
    index, share = _segments(stamps_ns, at_ns)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return values[index] * (1.0 - share) + values[index + 1] * share


def slerp(stamps_ns: Stamps, wxyz: Array, at_ns: Stamps) -> Array:
    """Shortest arcs through quaternions (n, 4) at (m,) -> (m, 4). Shoemake, SIGGRAPH 1985."""
    index, share = _segments(stamps_ns, at_ns)
    a, b = wxyz[index], wxyz[index + 1]
    dot = np.sum(a * b, axis=1, keepdims=True)
    b, dot = np.where(dot < 0.0, -b, b), np.minimum(np.abs(dot), 1.0)
    angle = np.arccos(dot)
    sine = np.sin(angle)
    share = share[:, None]
    # Below 1e-6 rad the arc is its chord.
    small = sine < 1e-6
    safe = np.where(small, 1.0, sine)
    q = np.where(
        small,
        a * (1 - share) + b * share,
        (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / safe,
    )
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.where(q[:, :1] < 0.0, -q, q)


def _tips(truth: HandTruth) -> Array:
    missing = [tip for tip in TIPS if tip not in truth.points_m]
    if missing:
        raise CaptureError(
            f"truth.jsonl: points_m lacks {missing}; simulate the capture again with `rhot simulate`"
        )
    return np.array([truth.points_m[tip] for tip in TIPS])


def _increasing(stamps: list[int], what: str) -> Stamps:
    if len(stamps) < 2:
        raise CaptureError(
            f"{what}: {len(stamps)} line(s) in truth.jsonl; at least 2 are needed to score against it"
        )
    array = np.array(stamps, dtype=np.int64)
    if np.any(np.diff(array) <= 0):
        raise CaptureError(
            f"{what}: two lines of truth.jsonl have the same stamp_ns; simulate the capture again"
        )
    return array


def _seconds(stamps_ns: Stamps, origin_ns: Stamps) -> Array:
    return (stamps_ns - origin_ns[0]) * 1e-9


def _segments(stamps_ns: Stamps, at_ns: Stamps) -> tuple[npt.NDArray[np.intp], Array]:
    """Segment number and share 0..1 within it of each instant; (m,), (m,)."""
    index = np.clip(np.searchsorted(stamps_ns, at_ns, side="right") - 1, 0, len(stamps_ns) - 2)
    return index, (at_ns - stamps_ns[index]) / (stamps_ns[index + 1] - stamps_ns[index])
