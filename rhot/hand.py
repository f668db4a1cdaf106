"""The one description of a hand: joints, bones, limits, painted landmarks, and where they all are.

`forward` is the plain forward kinematics; the solver and the simulator have compiled kernels of it,
and their tests prove that they agree with it.

Frames (docs/reference/frames.md): the wrist frame is OpenXR's: -z towards the finger tips, +y out
of the back of the hand, +x right. Each joint frame has -z along the bone that starts there. Angles
in radians:
  flexion    positive towards the palm (a rotation about -x of the joint frame);
  abduction  positive towards the thumb side of the hand (radial); for the thumb, away from the palm
             plane (palmar).
Each digit is one chain of four degrees of freedom, DIGIT_ANGLES: abduction, then three flexions.
The chain of a finger starts at its MCP joint (mcp, pip, dip), that of the thumb at its CMC joint
(cmc, mcp, dip): the thumb has no middle phalanx, its interphalangeal joint is called `dip` as its
bone is the distal one, and its MCP abduction is fixed at zero, RHOT eq. (3). Pure data and maths; a
hand that was never measured uses the tables of rhot/hand_tables.py and says so in HandModel.origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import msgspec
import numpy as np

from rhot import hand_tables
from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_x,
    rotation_y,
    rotation_z,
)

HandName = Literal["left", "right"]
HANDS: tuple[HandName, ...] = ("left", "right")

DIGITS = ("thumb", "index", "middle", "ring", "little")

_THUMB_JOINTS = ("thumb_metacarpal", "thumb_proximal", "thumb_distal", "thumb_tip")
_FINGER_BONES = ("metacarpal", "proximal", "intermediate", "distal", "tip")

# The 26 joints of XR_EXT_hand_tracking in the order of XrHandJointEXT (OpenXR 1.1, section 12.55).
JOINTS: tuple[str, ...] = (
    "palm",
    "wrist",
    *_THUMB_JOINTS,
    *(f"{finger}_{bone}" for finger in DIGITS[1:] for bone in _FINGER_BONES),
)
JOINT_INDEX = {name: index for index, name in enumerate(JOINTS)}

# What a dab of paint can mark: the six of the RHOT paper first, then any other joint as an extra.
TIPS = tuple(f"{digit}_tip" for digit in DIGITS)
BASIC_LANDMARKS = ("wrist", *TIPS)
LANDMARKS = (*BASIC_LANDMARKS, *(name for name in JOINTS if name not in BASIC_LANDMARKS))

# The four joints of each digit's chain: root, second, third, tip (indices into JOINTS), (5, 4).
CHAIN_JOINTS = np.array(
    [[JOINT_INDEX[j] for j in _THUMB_JOINTS]]
    + [[JOINT_INDEX[f"{finger}_{bone}"] for bone in _FINGER_BONES[1:]] for finger in DIGITS[1:]]
)

# Names of the four angles of each chain, in the order of the columns of an angle array (5, 4).
FINGER_ANGLES = ("abduction", "mcp", "pip", "dip")
THUMB_ANGLES = ("abduction", "cmc", "mcp", "dip")
DIGIT_ANGLES = (THUMB_ANGLES, *(FINGER_ANGLES,) * 4)

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
Length = Annotated[float, msgspec.Meta(ge=0.0, le=0.2)]
Range = tuple[float, float]


class Digit(msgspec.Struct, frozen=True, kw_only=True):
    """One digit: where its chain starts in the wrist frame, its bones, radii, limits, coupling."""

    name: Literal["thumb", "index", "middle", "ring", "little"]
    # Start of the metacarpal (equal to base_m for the thumb), for the OpenXR metacarpal joint only.
    metacarpal_m: Vec3
    # Root of the chain: MCP joint of a finger, CMC joint of the thumb, in the wrist frame.
    base_m: Vec3
    # Orientation of the first bone at zero angles, in the wrist frame.
    base_wxyz: Quat
    # Lengths of the three bones: proximal, middle, distal with pulp (thumb: metacarpal, proximal,
    # distal with pulp).
    lengths_m: tuple[Length, Length, Length]
    # Skin radius about the four joints of the chain, root to tip.
    radii_m: tuple[Length, Length, Length, Length]
    # (low, high) of the four angles of DIGIT_ANGLES.
    limits_rad: tuple[Range, Range, Range, Range]
    # Type II constraint, RHOT eq. (4): last flexion = ratio * second flexion; weight 0 leaves it
    # free, 1 is the usual prior.
    coupling: float = 2.0 / 3.0
    coupling_weight: float = 1.0


class Paint(msgspec.Struct, frozen=True, kw_only=True):
    """A painted landmark: the point that stands for it, in its joint's frame, and the paint's size.

    What cameras see is skin, yet two of them locate the centre of paint all round a finger
    (radius_m > 0) on the bone axis, within .3 radii: its outline is what counts. A dab on one side
    (radius_m = 0) lies where it is seen. See services/fusion/paint/paint_to_bone.py.
    """

    offset_m: Vec3
    radius_m: Length
    # Length of paint along the bone (tips: from the end of the finger; dabs: diameter).
    extent_m: Length


class HandModel(msgspec.Struct, frozen=True, kw_only=True):
    """A person's hand; saved as calibration/hand.<hand>.json."""

    hand: HandName
    digits: tuple[Digit, Digit, Digit, Digit, Digit]
    paint: dict[str, Paint]
    wrist_radius_m: Length = 0.021
    palm_radius_m: Length = 0.018
    # Where the numbers come from: "tables" or the tool that measured them.
    origin: str = "tables"
    date: str = ""
    tool: str = ""

    @property
    def lengths_m(self) -> Array:
        """(5, 3) bone lengths."""
        return np.array([digit.lengths_m for digit in self.digits])

    @property
    def limits_rad(self) -> Array:
        """(5, 4, 2) low and high of every angle."""
        return np.array([digit.limits_rad for digit in self.digits])

    @property
    def side(self) -> float:
        """+1 for a right hand, -1 for a left one: the sign that mirrors abduction."""
        return 1.0 if self.hand == "right" else -1.0


# Painted length of a finger tip: a dip into paint about as deep as the nail is long.
_TIP_PAINT_M = 0.014
# Diameter of a dab of paint.
_KNUCKLE_DAB_M = 0.010
_WRIST_DAB_M = 0.016


def default_hand(hand: HandName = "right", scale: float = 1.0) -> HandModel:
    """A hand from the anthropometric tables, `scale` times the average adult's."""
    thumb, index, middle, ring, little = (_default_digit(name, hand, scale) for name in DIGITS)
    return HandModel(
        hand=hand,
        digits=(thumb, index, middle, ring, little),
        paint=_default_paint(scale),
        wrist_radius_m=0.021 * scale,
    )


def _default_digit(name: str, hand: HandName, scale: float) -> Digit:
    bones = np.array(hand_tables.BONES_MM[name]) * 1e-3 * scale
    carpus = np.array(hand_tables.CARPUS_MM[name]) * 1e-3 * scale
    if name == "thumb":
        base, rotation = carpus, _thumb_rotation()
        lengths, limits = (bones[0], bones[1], bones[3]), hand_tables.THUMB_LIMITS_DEG
    else:
        direction = rotation_y(np.deg2rad(hand_tables.METACARPAL_DEG[name]))
        base = carpus + direction @ np.array([0.0, 0.0, -bones[0]])
        splay, roll = np.deg2rad(hand_tables.SPLAY_DEG[name])
        rotation = rotation_y(splay) @ rotation_z(roll)
        lengths, limits = (bones[1], bones[2], bones[3]), hand_tables.FINGER_LIMITS_DEG
        if name == "middle":
            limits = hand_tables.MIDDLE_LIMITS_DEG
    if hand == "left":
        mirror = np.diag([-1.0, 1.0, 1.0])
        carpus, base, rotation = mirror @ carpus, mirror @ base, mirror @ rotation @ mirror
    radii_m = tuple(float(r) * 1e-3 * scale for r in hand_tables.RADII_MM[name])
    limits_rad = tuple((float(np.deg2rad(low)), float(np.deg2rad(high))) for low, high in limits)
    return Digit(
        name=name,  # type: ignore[arg-type]
        metacarpal_m=tuple(carpus.tolist()),
        base_m=tuple(base.tolist()),
        base_wxyz=tuple(quaternion_from_rotation(rotation).tolist()),
        lengths_m=tuple(float(length) for length in lengths),  # type: ignore[arg-type]
        radii_m=radii_m,  # type: ignore[arg-type]
        limits_rad=limits_rad,  # type: ignore[arg-type]
    )


def _thumb_rotation() -> Array:
    """Axes of a right thumb's metacarpal at zero angles, in the wrist frame; (3, 3)."""
    z = -np.array(hand_tables.THUMB_FORWARD)
    x = np.array(hand_tables.THUMB_RIGHT)
    z /= np.linalg.norm(z)
    y = np.cross(z, x) / np.linalg.norm(np.cross(z, x))
    return np.stack([np.cross(y, z), y, z], axis=1)


def _default_paint(scale: float) -> dict[str, Paint]:
    """Tips painted all round, a dab on the palm side of the wrist, on the back of other joints."""
    paint = {}
    for name in LANDMARKS:
        if name == "wrist":
            offset_m, radius_m, extent_m = (0.0, -0.021 * scale, 0.0), 0.0, _WRIST_DAB_M
        elif name in TIPS:
            offset_m, extent_m = (0.0, 0.0, 0.5 * _TIP_PAINT_M), _TIP_PAINT_M
            radius_m = hand_tables.RADII_MM[name.removesuffix("_tip")][3] * 1e-3 * scale
        else:
            height = 0.018 if name == "palm" or name.endswith("metacarpal") else 0.009
            offset_m, radius_m, extent_m = (0.0, height * scale, 0.0), 0.0, _KNUCKLE_DAB_M
        paint[name] = Paint(offset_m=offset_m, radius_m=radius_m, extent_m=extent_m)
    return paint


def forward(
    model: HandModel, wrist_rotation: Array, wrist_m: Array, angles_rad: Array
) -> tuple[Array, Array]:
    """Positions (26, 3) and rotations (26, 3, 3) of all joints, in the frame the wrist is given in.

    wrist_rotation (3, 3), wrist_m (3,) metres, angles_rad (5, 4) in the order of DIGITS and
    DIGIT_ANGLES. Equal to the D-H rows of the finger study (Appendix A1) with its axes renamed;
    tests compare the two.
    """
    positions, rotations = np.zeros((26, 3)), np.tile(np.eye(3), (26, 1, 1))
    for row, digit in enumerate(model.digits):
        joints = CHAIN_JOINTS[row]
        if row > 0:
            metacarpal = joints[0] - 1
            positions[metacarpal] = digit.metacarpal_m
        abduction, *flexions = angles_rad[row]
        positions[joints], rotations[joints] = chain_forward(
            rotation_from_quaternion(digit.base_wxyz),
            np.array(digit.base_m),
            digit.lengths_m,
            (model.side * abduction, *flexions),
        )
    middle = JOINT_INDEX["middle_proximal"]
    positions[JOINT_INDEX["palm"]] = 0.5 * (positions[middle - 1] + positions[middle])
    return positions @ wrist_rotation.T + wrist_m, wrist_rotation @ rotations


def chain_forward(
    base_rotation: Array, base_m: Array, lengths_m: Sequence[float], angles_rad: Sequence[float]
) -> tuple[Array, Array]:
    """Positions (4, 3) and rotations (4, 3, 3) of one digit's joints, root to tip.

    In the frame of base_rotation (3, 3), the first bone's axes at zero angles, and base_m (3,), the
    root. lengths_m (3,); angles_rad (4,): about +y, then three flexions.
    """
    turn, *flexions = angles_rad
    positions, rotations = np.empty((4, 3)), np.empty((4, 3, 3))
    rotation, position = base_rotation @ rotation_y(turn), base_m
    for k, (flexion, length) in enumerate(zip(flexions, lengths_m, strict=True)):
        rotation = rotation @ rotation_x(-flexion)
        positions[k], rotations[k] = position, rotation
        position = position - length * rotation[:, 2]
    positions[3], rotations[3] = position, rotation
    return positions, rotations


def landmark_point(model: HandModel, name: str, positions: Array, rotations: Array) -> Array:
    """The point (3,) that stands for a painted landmark, given all joints as `forward` has them."""
    joint = JOINT_INDEX[name]
    return positions[joint] + rotations[joint] @ np.array(model.paint[name].offset_m)


def joint_radii_m(model: HandModel) -> Array:
    """Skin radius about each of the 26 joints; (26,)."""
    radii = np.full(26, model.palm_radius_m)
    radii[JOINT_INDEX["wrist"]] = model.wrist_radius_m
    for row, digit in enumerate(model.digits):
        radii[CHAIN_JOINTS[row]] = digit.radii_m
    return radii
