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


@dataclass(frozen=True, eq=False)
class Chains:
    """The landmarks of n dots in order, and the b bones between neighbours on a chain."""

    landmarks: tuple[str, ...]
    digits: Indices  # (n,) row of DIGITS, -1 of palm and wrist
    bones: Indices  # (b, 2) indices of the nearer and the further landmark
    lengths_m: Array  # (b,) of an average adult
    # (s,) of an average adult's straight hand: the bones, then from each finger's root to the next.
    spans_m: Array


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
    return Chains(
        landmarks=names,
        digits=digits,
        bones=pairs[:count],
        lengths_m=lengths[:count],
        spans_m=lengths,
    )


def digit_row(landmark: str) -> int:
    """The row of DIGITS that a landmark belongs to, -1 of palm and wrist."""
    digit = landmark.split("_", 1)[0]
    return DIGITS.index(digit) if digit in DIGITS else -1


def finger_landmarks(digit: str) -> tuple[str, ...]:
    """The four joints of a finger's chain from its root to its tip."""
    return tuple(JOINTS[index] for index in CHAIN_JOINTS[DIGITS.index(digit)])
