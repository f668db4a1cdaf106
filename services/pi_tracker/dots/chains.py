"""How dots hang together: the chain of bones from the wrist to each tip.

Pure. A landmark's parent is the nearest one towards the wrist that has a dot; roots of fingers
without one hang on the hand as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from rhot.hand import CHAIN_JOINTS, DIGITS, JOINTS, default_hand, forward

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# What a dot's acceleration is made of, in units of the whole hand's: the hand's turning, each
# finger's shift, the turning of each of its joints (of the thumb's so much of that), and its own;
# turnings per _ARM_M of distance. Fitted to the accelerations of four Leap recordings at 30 Hz
# (maximum likelihood, their 20 joints): .5 to 1.2 nats a dot and axis more likely than fingers
# whose bones move each on its own, also on two of them with figures fitted to the other two.
_HAND_TURN, _FINGER_SHIFT, _JOINT_TURN, _THUMB_SHARE, _OWN = 0.85, 0.07, 1.0, 0.8, 0.03
_ARM_M = 0.08


@dataclass(frozen=True, eq=False)
class Chains:
    """The landmarks of n dots in order, and the b bones between neighbours on a chain."""

    landmarks: tuple[str, ...]
    digits: Indices  # (n,) row of DIGITS, -1 of palm and wrist
    bones: Indices  # (b, 2) indices of the nearer and the further landmark
    lengths_m: Array  # (b,) of an average adult
    # (s, 2) pairs whose distance has an upper limit: the bones, then neighbouring fingers' roots.
    spans: Indices
    spans_m: Array  # (s,) of an average adult's straight hand
    triples: Indices  # (t, 3) bones of a finger, each the next one's parent
    acceleration: Array  # (n, n) covariance of the dots' accelerations, the whole hand's is 1


def chains_of(landmarks: Sequence[str]) -> Chains:
    """The chains of the named landmarks, whatever their order. Raises ValueError on an unknown."""
    unknown = [name for name in landmarks if name not in JOINTS]
    if unknown:
        raise ValueError(f"no landmark of a hand: {unknown[0]!r}; valid are {', '.join(JOINTS)}")
    names = tuple(landmarks)
    digit_of = {name: digit_row(name) for name in names}
    bones, roots = [], []
    for row in range(len(DIGITS)):
        own = sorted((n for n in names if digit_of[n] == row), key=JOINTS.index)
        roots += own[:1]
        bones += [(names.index(a), names.index(b)) for a, b in pairwise(own)]
    rest, _ = forward(default_hand("right"), np.eye(3), np.zeros(3), np.zeros((5, 4)))
    places = rest[[JOINTS.index(name) for name in names]]
    spans = bones + [(names.index(a), names.index(b)) for a, b in pairwise(roots)]
    pairs = np.array(spans, np.int64).reshape(-1, 2)
    lengths = np.linalg.norm(places[pairs[:, 1]] - places[pairs[:, 0]], axis=1)
    digits = np.array([digit_of[name] for name in names], np.int64)
    count = len(bones)
    # The thumb's joints do not turn about parallel axes.
    triples = [
        (k, k + 1, k + 2)
        for k in range(count - 2)
        if digits[pairs[k, 0]] == digits[pairs[k + 2, 0]] > 0
    ]
    return Chains(
        landmarks=names,
        digits=digits,
        bones=pairs[:count],
        lengths_m=lengths[:count],
        spans=pairs,
        spans_m=lengths,
        triples=np.array(triples, np.int64).reshape(-1, 3),
        acceleration=_acceleration(names, digits, places),
    )


def digit_row(landmark: str) -> int:
    """The row of DIGITS that a landmark belongs to, -1 of palm and wrist."""
    digit = landmark.split("_", 1)[0]
    return DIGITS.index(digit) if digit in DIGITS else -1


def finger_landmarks(digit: str) -> tuple[str, ...]:
    """The four joints of a finger's chain from its root to its tip."""
    return tuple(JOINTS[index] for index in CHAIN_JOINTS[DIGITS.index(digit)])


def _acceleration(names: Sequence[str], digits: Indices, places: Array) -> Array:
    """Covariance of accelerations (n, n) of dots at places (n, 3) of a straight hand."""
    # Columns are what moves on its own: of the hand three turns and a shift, then of each finger.
    columns = [np.ones(len(names)), *(_HAND_TURN * (places - places.mean(axis=0)) / _ARM_M).T]
    rest, _ = forward(default_hand("right"), np.eye(3), np.zeros(3), np.zeros((5, 4)))
    for row in sorted(set(digits.tolist()) - {-1}):
        own = digits == row
        share = _THUMB_SHARE if row == 0 else 1.0
        columns.append(share * _FINGER_SHIFT * own)
        joints = CHAIN_JOINTS[row]
        for joint in joints[:-1].tolist():
            # A joint turns what lies beyond it.
            beyond = np.array([JOINTS.index(name) > joint for name in names]) & own
            arms = np.linalg.norm(places - rest[joint], axis=1) / _ARM_M
            columns.append(share * _JOINT_TURN * arms * beyond)
    shares = np.stack(columns, axis=1)
    return np.asarray(shares @ shares.T + _OWN**2 * np.eye(len(names)))
