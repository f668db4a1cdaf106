"""Which points of a HandPoints message are fit to be solved with: values may be absurd (1e300, all
equal, from another hand).

A point is dropped when it is unknown, a repetition, not finite, beyond any room, or too vaguely
placed to say anything; and of points that lie further apart than one hand can be, those that
disagree with most others. Missing points are no error: fewer equations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HandModel, landmark_point
from rhot.messages import HandPoint, HandPoints
from services.solver.maths.kinematics import hand_chains, hand_frames
from services.solver.whole_hand.fit import place_of

# No camera of this kind sees a finger tip 10 m away.
_FAR_M = 10.0
# A point known to no better than a hand's length says nothing of a posture; one better than 0.3 mm
# is not skin.
_SIGMA_M = (3e-4, 0.15)
# A point carried on by fusion is trusted a third as much as one seen: its sigma says how it was
# filtered, not that it turned.
_PREDICTED = 3.0
# Two points of one hand may be further apart than the model says when its bones were never
# measured.
_SLACK = 1.25


@dataclass(frozen=True)
class Seen:
    """One usable landmark: where (3,) in the rig frame, 1 / sigma (3,) per metre along its axes,
    and whether a camera saw it.
    """

    point_m: Array
    inverse_sigma: Array
    measured: bool


@dataclass(frozen=True)
class Place:
    """Where a landmark sits on the hand (see whole_hand.Marks) and how far it can be from the wrist
    marker, metres.
    """

    joint: int
    digit: int
    depth: int
    offset_m: Array
    reach_m: float


def places(model: HandModel) -> dict[str, Place]:
    """Every landmark the model has paint for."""
    chains = hand_chains(model)
    positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
    # An open hand is at its longest.
    angles = np.clip(np.zeros((5, 4)), chains.limits_rad[:, :, 0], chains.limits_rad[:, :, 1])
    hand_frames(chains, np.eye(3), np.zeros(3), angles, positions, rotations)
    result = {}
    for name in model.paint:
        joint, digit, depth, offset = place_of(model, name)
        reach = float(np.linalg.norm(landmark_point(model, name, positions, rotations)))
        result[name] = Place(joint, digit, depth, offset, reach)
    return result


def usable(points: HandPoints, known: Mapping[str, Place]) -> dict[str, Seen]:
    """The points worth solving with, by landmark, in the order of the message."""
    seen: dict[str, Seen] = {}
    for point in points.points:
        if point.name in known and point.name not in seen and _sane(point):
            sigma = np.clip(point.sigma_m, *_SIGMA_M) * (
                1.0 if point.source == "measured" else _PREDICTED
            )
            seen[point.name] = Seen(
                np.array(point.position_m), 1.0 / sigma, point.source == "measured"
            )
    return _of_one_hand(seen, known)


def _sane(point: HandPoint) -> bool:
    inside = all(math.isfinite(value) and abs(value) <= _FAR_M for value in point.position_m)
    return inside and all(math.isfinite(sigma) and sigma <= _SIGMA_M[1] for sigma in point.sigma_m)


def _of_one_hand(seen: dict[str, Seen], known: Mapping[str, Place]) -> dict[str, Seen]:
    """Drop, one at a time, the point that is too far from most others."""
    while len(seen) > 1:
        names = list(seen)
        where = np.array([seen[name].point_m for name in names])
        reach = np.array([known[name].reach_m for name in names])
        apart = np.linalg.norm(where[:, None] - where[None], axis=2)
        wrong = (apart > _SLACK * (reach[:, None] + reach[None])).sum(axis=1)
        worst = int(wrong.argmax())
        if wrong[worst] == 0:
            break
        seen = {name: seen[name] for name in names if name != names[worst]}
    return seen
