"""A finger in its plane of flexion: joints from angles, and the solver's chain of the same. Pure.

The solver's chains live in a canonical frame (services/solver/maths/chains.py): bones along -z,
palm towards -y. The plane's x (along the base line) is -z there, its y (towards the palm) is -y,
and abduction is 0. The kinematics stand here once more for many frames at a time; a test compares
them with the solver's.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from services.solver.maths.chains import Chain
from studies.grasp.recording import Angle

_ANGLES: tuple[Angle, ...] = get_args(Angle)
# The law that hands are solved with where nothing else is known: DIP = 2/3 PIP.
TWO_THIRDS = 2.0 / 3.0
# deg; low and high of MCP, PIP, DIP. A finger's MCP and DIP hyperextend by up to 45 and 30 deg
# (AAOS, Joint Motion; FACTS: -31 in a pinch). PIP stops at straight: a tip's pose has two
# postures, elbow up and down, and a few degrees below 0 would make every straight finger
# ambiguous. Who hyperextends there gives a limit.
_FINGER_DEG = ((-45.0, 105.0), (0.0, 125.0), (-30.0, 100.0))
# The same of a thumb's CMC, MCP and IP joints, against a base line somebody drew.
_THUMB_DEG = ((-70.0, 70.0), (-20.0, 90.0), (-30.0, 100.0))


def joints_of(angles_rad: Array, lengths: Array) -> Array:
    """Joints (n, 4, 2) in the plane, MCP at 0; angles (n, 3), lengths (3,) or (n, 3)."""
    turns = np.cumsum(angles_rad, axis=-1)
    bones = np.stack([np.cos(turns), np.sin(turns)], axis=-1) * np.asarray(lengths)[..., None]
    root = np.zeros((len(angles_rad), 1, 2))
    return np.concatenate([root, np.cumsum(bones, axis=1)], axis=1)


def limits_of(finger: str, own_deg: Mapping[Angle, tuple[float, float]]) -> Array:
    """Limits (4, 2) rad of abduction and the three flexions; own_deg go before the tables'."""
    table = _THUMB_DEG if finger == "thumb" else _FINGER_DEG
    rows = [own_deg.get(name, row) for name, row in zip(_ANGLES, table, strict=True)]
    return np.deg2rad([(0.0, 0.0), *rows])


def read_limit(text: str) -> tuple[Angle, tuple[float, float]]:
    """`pip:-10:120` as a joint and its limits in deg. Raises CaptureError."""
    try:
        name, low, high = text.split(":")
        limits = (float(low), float(high))
    except ValueError:
        name, limits = "", (0.0, 0.0)
    known = next((angle for angle in _ANGLES if angle == name), None)
    if known is None or not -180.0 <= limits[0] < limits[1] <= 180.0:
        raise CaptureError(
            f"--limit {text}: expected JOINT:LOW:HIGH in degrees, such as pip:-10:120; JOINT is one"
            f" of {', '.join(_ANGLES)}"
        )
    return known, limits


def chain_of(lengths: Array, limits: Array, ratio: float = TWO_THIRDS) -> Chain:
    """The solver's chain of lengths (3,), with DIP = ratio * PIP."""
    first, middle, last = lengths.tolist()
    return Chain(
        np.array([first, middle, last]),
        np.array([0.0, 0.0, -last]),
        limits,
        np.array([ratio, 1.0]),
    )


def canonical(point: Array) -> Array:
    """A point (2,) of the plane in the canonical frame, (3,)."""
    return np.array([0.0, -point[1], -point[0]])
