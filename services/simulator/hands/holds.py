"""Where an object lies in a hand that holds it, and how the hand holds it. Pure.

The object's y axis lies across the palm, its tracker on the little finger's side. It lies against
the palm, as far out along the hand as lets most digits touch and the thumb press against the
fingers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.solids import Solid, capsule_distance
from rhot.geometry.transforms import Array, apply, inverse, rotation_y, rotation_z, transform
from rhot.hand import HandModel, default_hand, forward, joint_radii_m
from rhot.hand_skin import PARTS, Skin, skin_of
from services.simulator.hands.closing import Closed, close_finger, close_thumb, reaches
from services.simulator.hands.gestures import GRIP, OPEN, LimitScaling

# A hand that is about to take something: the thumb stands off.
_WIDE = np.concatenate([[[22.0, -20.0, 2.0, 0.0]], OPEN[1:]])
# From the wrist to the object's middle, along the average adult's hand: tried in this order.
_ALONG_M = (0.095, 0.085, 0.105)
# A touch is this deep: skin gives way.
_TOUCH_M = -1e-4
# How far from the palm an object can be looked for, and how often that is halved (to 1 um).
_FARTHEST_M, _HALVINGS = 0.25, 18


class Grip(NamedTuple):
    """How a hand is to hold something.

    gap_m keeps all skin so far from the surface; 0 touches. tilt_rad turns the object's axis in
    the plane of the palm; palm_gap_m is the distance of the palm beyond gap_m.
    """

    gap_m: float = 0.0
    palm_gap_m: float = 0.0
    tilt_rad: float = 0.5


class Hold(NamedTuple):
    """A hand that holds an object."""

    T_wrist_from_object: Array  # (4, 4)
    open_rad: Array  # (5, 4)
    closed_rad: Array  # (5, 4)
    touching: tuple[bool, ...]  # of the five digits


def hold(model: HandModel, solid: Solid, grip: Grip) -> Hold:
    """The best of a few places of the object in the hand."""
    found = [_hold_at(model, solid, grip, _place(model, solid, grip, out)) for out in _ALONG_M]
    best = max(found, key=lambda one: one[0])[1]
    # The ball of the thumb has moved with it: the palm is somewhere else by a millimetre.
    skin = skin_at(model, *forward(model, np.eye(3), np.zeros(3), best.closed_rad))
    gaps = part_distances(solid, skin, inverse(best.T_wrist_from_object))
    nearer = best.T_wrist_from_object.copy()
    nearer[1, 3] += gaps[PARTS.index("palm")] - _palm_m(grip)
    return _hold_at(model, solid, grip, nearer)[1]


def skin_at(model: HandModel, positions: Array, rotations: Array) -> Skin:
    """The skin of a hand whose joints are there: (26, 3), (26, 3, 3)."""
    return skin_of(positions, rotations, joint_radii_m(model), model.side)


def part_distances(solid: Solid, skin: Skin, T_object_from_skin: Array) -> Array:
    """Distance of each of PARTS to a solid, (6,) m; T brings the skin's frame to the object's."""
    ends = apply(T_object_from_skin, skin.ends_m.reshape(-1, 3)).reshape(-1, 2, 3)
    gap = capsule_distance(solid, ends, skin.radii_m).distance_m
    return np.array([gap[skin.part == row].min() for row in range(len(PARTS))])


def _place(model: HandModel, solid: Solid, grip: Grip, out_m: float) -> Array:
    """T_wrist_from_object (4, 4) of an object that lies before the palm."""
    size = float(np.mean(model.lengths_m[1:]) / np.mean(default_hand(model.hand).lengths_m[1:]))
    # y of the object towards the thumb.
    across = rotation_y(-model.side * grip.tilt_rad) @ rotation_z(model.side * 0.5 * np.pi)
    open_rad = LimitScaling(model)(_WIDE)
    skin = skin_at(model, *forward(model, np.eye(3), np.zeros(3), open_rad))
    wanted = _palm_m(grip)

    def at(below_m: float) -> Array:
        return transform(across, (0.0, -below_m, -out_m * size))

    # Nearest place at which the palm keeps its distance.
    low, high = 0.0, _FARTHEST_M
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        near = part_distances(solid, skin, inverse(at(middle)))[PARTS.index("palm")] < wanted
        low, high = (middle, high) if near else (low, middle)
    return at(high)


def _palm_m(grip: Grip) -> float:
    """How far the palm is to be from the surface."""
    return (grip.gap_m or _TOUCH_M) + grip.palm_gap_m


def _hold_at(
    model: HandModel, solid: Solid, grip: Grip, T_wrist_from_object: Array
) -> tuple[float, Hold]:
    """How good a hold is, and the hold."""
    scale = LimitScaling(model)
    open_rad, gripped = scale(_WIDE), scale(GRIP)
    thumb, *fingers = reaches(model, solid, T_wrist_from_object, grip.gap_m or _TOUCH_M)
    closed: list[Closed] = [
        close_finger(reach, open_rad[row], float(gripped[row, 0]))
        for row, reach in enumerate(fingers, start=1)
    ]
    normals = [one.normal for one in closed if one.touching] or [one.normal for one in closed]
    against = np.mean(normals, axis=0)
    closed.insert(0, close_thumb(thumb, open_rad[0], against))
    touching = tuple(one.touching for one in closed)
    # A finger more counts for more than any direction of the thumb.
    worth = sum(touching) - float(closed[0].normal @ against)
    angles = np.array([one.angles_rad for one in closed])
    return worth, Hold(T_wrist_from_object, open_rad, angles, touching)
