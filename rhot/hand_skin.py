"""The skin of a hand that touches things: tapered capsules about the joints, part by part.

A finger touches with its last bone, from the joint before it to the skin at its end, so the pad
counts as the very tip does. The palm is the bones of the hand with the balls of thumb and little
finger and the pads below the fingers. A capsule is all balls between its two end balls. The skin of
the simulator's hands (services/simulator/hands/bodies.py) is made of the same ones. Pure.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, JOINT_INDEX

SkinPart = Literal["thumb", "index", "middle", "ring", "little", "palm"]
PARTS: tuple[SkinPart, ...] = ("thumb", "index", "middle", "ring", "little", "palm")

# Radius about the palm joint of the average adult's hand, whose millimetres stand below.
_AVERAGE_PALM_M = 0.018
# A ball: joint, where from it (right hand, mm), radius in mm, or 0: the joint's own skin.
_Ball = tuple[str, tuple[float, float, float], float]
_MIDDLE = (0.0, 0.0, 0.0)
PALM: tuple[tuple[_Ball, _Ball], ...] = (
    # Along the metacarpals.
    *(
        ((f"{name}_metacarpal", _MIDDLE, 14.0), (f"{name}_proximal", _MIDDLE, 0.0))
        for name in DIGITS[1:]
    ),
    # The ball of the thumb, that of the little finger, and the pads below the fingers.
    (("wrist", (-13.0, -9.0, -14.0), 15.0), ("thumb_proximal", (0.0, 0.0, 3.0), 12.0)),
    (("wrist", (18.0, -8.0, -18.0), 14.5), ("little_proximal", (3.0, -3.0, 14.0), 10.0)),
    (("index_proximal", (0.0, -2.0, 4.0), 10.0), ("middle_proximal", (0.0, -2.0, 4.0), 10.3)),
    (("middle_proximal", (0.0, -2.0, 4.0), 10.3), ("little_proximal", (0.0, -2.0, 4.0), 9.0)),
)


_COLUMNS = [end for pair in PALM for end in pair]
_BALL_JOINT = np.array([JOINT_INDEX[joint] for joint, _, _ in _COLUMNS])
_BALL_OFFSET = 1e-3 * np.array([offset for _, offset, _ in _COLUMNS])
_BALL_RADIUS = 1e-3 * np.array([radius for _, _, radius in _COLUMNS])
_TIP = np.array([JOINT_INDEX[f"{digit}_tip"] for digit in DIGITS])
_PART = np.array([*range(len(DIGITS)), *[PARTS.index("palm")] * len(PALM)])


class Skin(NamedTuple):
    """c tapered capsules, in the frame of the joints; part is a row of PARTS."""

    ends_m: Array  # (c, 2, 3)
    radii_m: Array  # (c, 2)
    part: npt.NDArray[np.int64]  # (c,)


def skin_of(positions: Array, rotations: Array, radii_m: Array, side: float) -> Skin:
    """The skin about 26 joints: positions (26, 3), rotations (26, 3, 3), radii_m (26,).

    In OpenXR order, as of rhot.hand.forward and joint_radii_m; side is HandModel.side.
    """
    start, tip = positions[_TIP - 1], positions[_TIP]
    # The skin ends at the tip joint: its last ball lies its radius before it, a short bone's at its
    # start.
    back = np.minimum(radii_m[_TIP], np.linalg.norm(tip - start, axis=1))
    ends = np.stack([start, tip + back[:, None] * rotations[_TIP][:, :, 2]], axis=1)
    scale = radii_m[JOINT_INDEX["palm"]] / _AVERAGE_PALM_M
    offset = scale * _BALL_OFFSET * [side, 1.0, 1.0]
    balls = positions[_BALL_JOINT] + np.einsum("bij,bj->bi", rotations[_BALL_JOINT], offset)
    own = np.where(_BALL_RADIUS > 0.0, scale * _BALL_RADIUS, radii_m[_BALL_JOINT])
    return Skin(
        np.concatenate([ends, balls.reshape(-1, 2, 3)]),
        np.concatenate([np.stack([radii_m[_TIP - 1], radii_m[_TIP]], axis=1), own.reshape(-1, 2)]),
        _PART,
    )
