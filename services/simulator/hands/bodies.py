"""The bodies of the simulated world: tapered capsules and solids fixed to moving body frames, and
dabs of paint on them. Pure data.

A body frame is an OpenXR joint of a hand, its forearm, or an object. All lengths are in metres, all
offsets in the axes of the body frame they belong to. A left hand is the mirror image of a right
one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from rhot.hand import JOINT_INDEX, TIPS, Digit, HandModel

Ints = npt.NDArray[np.int64]

# Body frames of one hand: its 26 joints, and the forearm, which does not follow the wrist's motion.
HAND_FRAMES = 27
ARM = 26

# Which solid a row of the table is: a tapered capsule, a cylinder with flat ends, a box, or one of
# the meshes, by number from MESH on.
CAPSULE, CYLINDER, BOX, MESH = 0, 1, 2, 3

Vec3 = tuple[float, float, float]
_O: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class ShapeArrays:
    """c capsules and solids, and d dabs, as arrays.

    A solid has the capsule that holds it, along one of its axes.
    """

    frame: Ints  # (c, 2) which body frame either end is fixed to
    offset: Array  # (c, 2, 3) m
    radius: Array  # (c, 2) m
    # (c, 4) surface, surface of the painted end or -1, whether dabs stick to it, which solid
    kind: Ints
    # (c, 4) painted length; by how much it is longer on the palm's side, on the side that lies
    # right of it as one looks along the bone, and on both of them alike
    end_m: Array
    half: Array  # (c, 2) m, half a box along the body's y and z
    dab_frame: Ints  # (d,)
    dab_offset: Array  # (d, 3) m
    dab_radius: Array  # (d,) m
    dab_surface: Ints  # (d,)


@dataclass
class ShapeBuilder:
    """Collects capsules and dabs one at a time; `arrays` is what the renderer works on."""

    frame: list[tuple[int, int]] = field(default_factory=list)
    offset: list[tuple[Vec3, Vec3]] = field(default_factory=list)
    radius: list[tuple[float, float]] = field(default_factory=list)
    # Surface of the capsule, surface of its painted end (-1: none), painted length and how it
    # leans, whether dabs stick to it.
    surface: list[int] = field(default_factory=list)
    end_surface: list[int] = field(default_factory=list)
    end_m: list[tuple[float, float, float, float]] = field(default_factory=list)
    dabbed: list[bool] = field(default_factory=list)
    solid: list[int] = field(default_factory=list)
    half: list[tuple[float, float]] = field(default_factory=list)
    dab_frame: list[int] = field(default_factory=list)
    dab_offset: list[Vec3] = field(default_factory=list)
    dab_radius: list[float] = field(default_factory=list)
    dab_surface: list[int] = field(default_factory=list)

    def capsule(
        self,
        a: tuple[int, Vec3, float],
        b: tuple[int, Vec3, float],
        surface: int,
        end: tuple[int, float] = (-1, 0.0),
        *,
        lean_m: Vec3 = _O,
        dabbed: bool = False,
    ) -> None:
        """Add a tapered capsule between two balls (body frame, offset, radius).

        end = (surface, metres) paints the last part of it, before the far end of ball b; lean_m is
        what ShapeArrays.end_m has after the length.
        """
        self.frame.append((a[0], b[0]))
        self.offset.append((a[1], b[1]))
        self.radius.append((a[2], b[2]))
        self.surface.append(surface)
        self.end_surface.append(end[0])
        self.end_m.append((end[1], *lean_m))
        self.dabbed.append(dabbed)
        self.solid.append(CAPSULE)
        self.half.append((0.0, 0.0))

    def cylinder(
        self, frame: int, ends_m: tuple[Vec3, Vec3], radius_m: float, surface: int
    ) -> None:
        """Add a cylinder with flat ends, whose middles are ends_m."""
        a, b = ends_m
        self.capsule((frame, a, radius_m), (frame, b, radius_m), surface)
        self.solid[-1] = CYLINDER

    def block(
        self, frame: int, low_m: Array, high_m: Array, surface: int, solid: int = BOX
    ) -> None:
        """Add a box along the axes of its body frame, or a mesh that fills it."""
        middle, half = 0.5 * (low_m + high_m), 0.5 * (high_m - low_m)
        radius = float(np.hypot(half[1], half[2]))
        a, b = (float(low_m[0]), *middle[1:].tolist()), (float(high_m[0]), *middle[1:].tolist())
        self.capsule((frame, a, radius), (frame, b, radius), surface)
        self.solid[-1], self.half[-1] = solid, (float(half[1]), float(half[2]))

    def dab(self, frame: int, offset_m: Vec3, diameter_m: float, surface: int) -> None:
        """Add paint on all skin within half the diameter of a point."""
        self.dab_frame.append(frame)
        self.dab_offset.append(offset_m)
        self.dab_radius.append(0.5 * diameter_m)
        self.dab_surface.append(surface)

    def arrays(self) -> ShapeArrays:
        """What was added so far."""
        columns = (self.surface, self.end_surface, self.dabbed, self.solid)
        kind = [np.array(values) for values in columns]
        return ShapeArrays(
            frame=np.array(self.frame, dtype=np.int64).reshape(-1, 2),
            offset=np.array(self.offset).reshape(-1, 2, 3),
            radius=np.array(self.radius).reshape(-1, 2),
            kind=np.stack(kind, axis=1).astype(np.int64),
            end_m=np.array(self.end_m, dtype=np.float64).reshape(-1, 4),
            half=np.array(self.half).reshape(-1, 2),
            dab_frame=np.array(self.dab_frame, dtype=np.int64),
            dab_offset=np.array(self.dab_offset).reshape(-1, 3),
            dab_radius=np.array(self.dab_radius, dtype=np.float64),
            dab_surface=np.array(self.dab_surface, dtype=np.int64),
        )


def add_hand(
    shapes: ShapeBuilder,
    model: HandModel,
    first: int,
    skin: int,
    paints: dict[str, int],
    leans_m: Mapping[str, Vec3] | None = None,
) -> None:
    """Add a hand whose body frames start at `first`.

    paints maps painted landmarks to surface numbers, skin is the surface of the rest; leans_m says
    of tips how unevenly they are painted (ShapeArrays.end_m after the length). Each finger's
    skin ends exactly at its OpenXR tip joint. The palm is a bundle of thick capsules along the
    metacarpals, with thenar, hypothenar and webs. The palm side of the wrist is where
    rhot.hand.Paint says, wrist_radius_m from the joint.
    """
    dabs = {name for name in paints if name not in TIPS or model.paint[name].radius_m == 0.0}
    for digit in model.digits:
        tip = f"{digit.name}_tip"
        painted = (-1 if tip in dabs else paints.get(tip, -1), model.paint[tip].extent_m)
        lean_m = (leans_m or {}).get(f"{digit.name}_tip", _O)
        _add_digit(shapes, digit, first, skin, (*painted, lean_m))
    _add_palm(shapes, model, first, skin)
    _add_forearm(shapes, model, first, skin)
    for name, surface in paints.items():
        if name in dabs:
            paint = model.paint[name]
            shapes.dab(first + JOINT_INDEX[name], paint.offset_m, paint.extent_m, surface)


def _add_digit(
    shapes: ShapeBuilder, digit: Digit, first: int, skin: int, painted: tuple[int, float, Vec3]
) -> None:
    """painted: surface, length and lean of the paint on its tip."""
    tip = JOINT_INDEX[f"{digit.name}_tip"]
    r0, r1, r2, r3 = digit.radii_m
    joints = [first + j for j in range(tip - 3, tip + 1)]
    for a, b, ra, rb in ((joints[0], joints[1], r0, r1), (joints[1], joints[2], r1, r2)):
        shapes.capsule((a, _O, ra), (b, _O, rb), skin, dabbed=True)
    # The last ball lies its radius before the tip; a distal bone shorter than that still gets a
    # ball.
    back = min(r3, digit.lengths_m[2])
    far = (joints[3], (0.0, 0.0, back), r3)
    surface, length_m, lean_m = painted
    shapes.capsule((joints[2], _O, r2), far, skin, (surface, length_m), lean_m=lean_m, dabbed=True)


def _add_palm(shapes: ShapeBuilder, model: HandModel, first: int, skin: int) -> None:
    scale, side = model.palm_radius_m / 0.018, model.side
    radius = {digit.name: digit.radii_m[0] for digit in model.digits}

    def ball(joint: str, x: float, y: float, z: float, r: float) -> tuple[int, Vec3, float]:
        # The numbers below are millimetres of an average right hand.
        return (
            first + JOINT_INDEX[joint],
            (side * x * 1e-3 * scale, y * 1e-3 * scale, z * 1e-3 * scale),
            r * 1e-3 * scale,
        )

    for finger in ("index", "middle", "ring", "little"):
        knuckle = (first + JOINT_INDEX[f"{finger}_proximal"], _O, radius[finger])
        shapes.capsule(ball(f"{finger}_metacarpal", 0, 0, 0, 14), knuckle, skin, dabbed=True)
    for a, b in (
        # Thenar eminence, web between thumb and index finger, hypothenar eminence, the pads below
        # the fingers (two), the hollow of the hand, its heel (two).
        (ball("wrist", -13, -9, -14, 15), ball("thumb_proximal", 0, 0, 3, 12)),
        (ball("index_metacarpal", 0, -4, -38, 10), ball("thumb_proximal", 0, 0, 6, 10)),
        (ball("wrist", 18, -8, -18, 14.5), ball("little_proximal", 3, -3, 14, 10)),
        (ball("index_proximal", 0, -2, 4, 10), ball("middle_proximal", 0, -2, 4, 10.3)),
        (ball("middle_proximal", 0, -2, 4, 10.3), ball("little_proximal", 0, -2, 4, 9)),
        (ball("index_metacarpal", 0, -3, -42, 12), ball("little_metacarpal", 0, -3, -34, 11.5)),
        (ball("wrist", -9, 0, -3, 19.5), ball("middle_metacarpal", -6, -2, 0, 16.5)),
        (ball("wrist", 9, 0, -3, 19.5), ball("ring_metacarpal", 4, -2, 0, 16)),
    ):
        shapes.capsule(a, b, skin, dabbed=True)


def _add_forearm(shapes: ShapeBuilder, model: HandModel, first: int, skin: int) -> None:
    r = model.wrist_radius_m
    wrist = first + JOINT_INDEX["wrist"]
    for x, end_x in ((0.0, 0.0), (-0.45, -0.7), (0.45, 0.7)):
        # The middle one carries the wrist dab: its surface is exactly wrist_radius_m from the
        # joint.
        near = r if x == 0.0 else 0.92 * r
        a, b = (model.side * x * r, 0.0, 0.0), (model.side * end_x * r, 0.0, 12.0 * r)
        shapes.capsule((wrist, a, near), (first + ARM, b, 1.45 * r), skin, dabbed=True)
