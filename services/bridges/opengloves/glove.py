"""A hand as a glove of OpenGloves: how far each joint is bent, in its two forms on a wire. Pure.

From LucidVR/opengloves-driver (MIT): the struct of version 2 of its named pipe, 120 bytes, and its
"alpha encoding" for serial lines, whose keys are letters.

Flexion is 0 (straight) to 1 (a fist) for four joints of each finger, thumb to little: metacarpal,
MCP, PIP, DIP of a finger; CMC, MCP, interphalangeal joint of the thumb, whose fourth is not used.
SteamVR's hand goes from open to fist by it, so it is a joint's share of its whole range. Splay is
-1 to 1 for 20 degrees to each side about the bone's y axis, which is away from the thumb where it
is positive; the thumb's own is left at 0. No button is ever pressed.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np

from rhot.hand import HandName
from rhot.hand_tables import FINGER_LIMITS_DEG, THUMB_LIMITS_DEG
from rhot.messages import HandPose

# flexion[5][4], splay[5], joyX, joyY; joyButton, trgButton, aButton, bButton, grab, pinch, menu,
# calibrate; trgValue. The bools are eight, so that the compiler adds no padding.
_STRUCT = struct.Struct("<20f 5f 2f 8? f")
SIZE = _STRUCT.size
# What a datagram to the helper on Windows begins with; the struct follows.
HELPER_MARKS: dict[HandName, bytes] = {"left": b"L", "right": b"R"}
# c_maxSplayAngle of the driver.
_SPLAY_RAD = np.deg2rad(20.0)
# max_analog_value of the driver; LucidGloves' firmware has the same on an ESP32.
_MOST = 4095
_FINGERS = "ABCDE"
_RANGES = np.deg2rad([THUMB_LIMITS_DEG[1:], *[FINGER_LIMITS_DEG[1:]] * 4])


class Glove(NamedTuple):
    """flexion (5, 4) in 0..1 and splay (5,) in -1..1, thumb to little."""

    flexion: list[list[float]]
    splay: list[float]


def glove_of(pose: HandPose) -> Glove:
    """What a glove on that hand would measure."""
    low, high = _RANGES[..., 0], _RANGES[..., 1]
    shares = np.clip((pose.angles_rad[:, 1:] - low) / (high - low), 0.0, 1.0)
    # A finger's metacarpal goes with its MCP, as a fist's does; the thumb has three joints.
    flexion = [[*shares[0], shares[0, 2]], *([row[0], *row] for row in shares[1:])]
    splay = np.clip(-pose.angles_rad[:, 0] / _SPLAY_RAD, -1.0, 1.0)
    return Glove([[float(one) for one in row] for row in flexion], [0.0, *splay[1:].tolist()])


def pipe_bytes(glove: Glove) -> bytes:
    """The struct of \\\\.\\pipe\\vrapplication\\input\\glove\\v2\\left and right."""
    joints = [one for row in glove.flexion for one in row]
    return _STRUCT.pack(*joints, *glove.splay, 0.0, 0.0, *(False,) * 8, 0.0)


def serial_line(glove: Glove) -> bytes:
    """A line as the firmware of a glove sends it, e.g. A0(AB)2048(AAA)0(AAB)...

    A letter for each finger: its whole bend (A), splay (AB) and joints (AAA to AAD).
    """
    words = []
    for finger, joints, splay in zip(_FINGERS, glove.flexion, glove.splay, strict=True):
        words.append(f"{finger}{_analog(sum(joints[1:]) / 3.0)}")
        words.append(f"({finger}B){_analog(0.5 + 0.5 * splay)}")
        # The first joint goes with the whole finger where it is not sent: a line has to be short
        # for 115200 baud.
        words += [
            f"({finger}A{joint}){_analog(share)}"
            for joint, share in zip("ABCD", joints, strict=True)
            if joint != "A" or finger == "A"
        ]
    return ("".join(words) + "\n").encode("ascii")


def _analog(share: float) -> int:
    return round(share * _MOST)
