"""Hands that differ as people's do, painted as somebody in a hurry paints them. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
)
from rhot.hand import TIPS, Digit, HandModel, HandName, Paint, default_hand

# HandModel.origin of these hands.
ORIGIN = "family"


@dataclass(frozen=True)
class Person:
    """A hand: its size against the average adult's, and what differs from the tables at that size.

    bones: the share by which each bone is longer or shorter at most; knuckle_mm, thumb_mm: how far
    the roots of fingers and thumb lie elsewhere, along each axis; turn_deg: how far their first
    bones point elsewhere; radii: share of the skin's radii.
    """

    scale: float = 1.0
    bones: float = 0.1
    knuckle_mm: float = 4.0
    thumb_mm: float = 6.0
    turn_deg: float = 4.0
    radii: float = 0.08
    seed: int = 1

    def model(self, hand: HandName = "right") -> HandModel:
        """The hand; its paint is the tables'."""
        rng = np.random.default_rng([self.seed, 71])
        table = default_hand(hand, self.scale)
        digits = tuple(self._digit(digit, rng) for digit in table.digits)
        paint = dict(table.paint)
        for digit in digits:
            name = f"{digit.name}_tip"
            paint[name] = msgspec.structs.replace(paint[name], radius_m=digit.radii_m[3])
        return msgspec.structs.replace(
            table,
            digits=digits,
            paint=paint,
            # default_hand leaves the palm's thickness as it is; a child's would bury its wrist.
            palm_radius_m=self.scale * table.palm_radius_m,
            origin=ORIGIN,
        )

    def _digit(self, digit: Digit, rng: np.random.Generator) -> Digit:
        def share(most: float, count: int) -> Array:
            return 1.0 + rng.uniform(-most, most, count)

        reach_mm = self.thumb_mm if digit.name == "thumb" else self.knuckle_mm
        base = np.array(digit.base_m) + 1e-3 * self.scale * rng.uniform(-reach_mm, reach_mm, 3)
        turn = rotation_from_vector(np.deg2rad(rng.uniform(-self.turn_deg, self.turn_deg, 3)))
        axes = turn @ rotation_from_quaternion(digit.base_wxyz)
        lengths = np.array(digit.lengths_m) * share(self.bones, 3)
        radii = np.array(digit.radii_m) * share(self.radii, 1)
        return msgspec.structs.replace(
            digit,
            metacarpal_m=tuple(base.tolist()) if digit.name == "thumb" else digit.metacarpal_m,
            base_m=tuple(base.tolist()),
            base_wxyz=tuple(quaternion_from_rotation(axes).tolist()),
            lengths_m=tuple(lengths.tolist()),
            radii_m=tuple(radii.tolist()),
        )


# The average adult of the tables.
TABLES = Person(bones=0.0, knuckle_mm=0.0, thumb_mm=0.0, turn_deg=0.0, radii=0.0)


@dataclass(frozen=True)
class PaintJob:
    """How long the painted tips are, each between these; how far off the wrist's dab is.

    uneven: the share of its length by which a painted edge leans (services/simulator SceneSpec).
    """

    length_mm: tuple[float, float] = (14.0, 14.0)
    dab_off_mm: float = 0.0
    uneven: float = 0.0
    seed: int = 1

    def on(self, model: HandModel) -> HandModel:
        """The hand with this paint: tips from their end on, the dab moved along the skin."""
        rng = np.random.default_rng([self.seed, 72])
        paint: dict[str, Paint] = dict(model.paint)
        for name in TIPS:
            length_m = 1e-3 * float(rng.uniform(*self.length_mm))
            paint[name] = msgspec.structs.replace(
                paint[name], offset_m=(0.0, 0.0, 0.5 * length_m), extent_m=length_m
            )
        angle = float(rng.uniform(0.0, 2.0 * np.pi))
        x, y, z = model.paint["wrist"].offset_m
        paint["wrist"] = msgspec.structs.replace(
            paint["wrist"],
            offset_m=(
                x + 1e-3 * self.dab_off_mm * float(np.cos(angle)),
                y,
                z + 1e-3 * self.dab_off_mm * float(np.sin(angle)),
            ),
        )
        return msgspec.structs.replace(model, paint=paint)
