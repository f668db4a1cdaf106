"""A glove's two forms, read as OpenGloves reads them."""

from __future__ import annotations

import ctypes
import re

import numpy as np
import pytest

from rhot.hand import default_hand
from services.bridges.opengloves.glove import SIZE, glove_of, pipe_bytes, serial_line
from testing.sample_hands import hand_pose, random_pose

BUTTONS = ["joyButton", "trgButton", "aButton", "bButton", "grab", "pinch", "menu", "calibrate"]


class V2PipeData(ctypes.Structure):
    """LucidVR/opengloves-driver's struct, as a C++ compiler lays it out."""

    _fields_ = (
        ("flexion", ctypes.c_float * 4 * 5),
        ("splay", ctypes.c_float * 5),
        ("joyX", ctypes.c_float),
        ("joyY", ctypes.c_float),
        *((name, ctypes.c_bool) for name in BUTTONS),
        ("trgValue", ctypes.c_float),
    )


def pose_of(degrees, hand="right"):
    return hand_pose(default_hand(hand), np.eye(3), np.zeros(3), np.radians(degrees))


def decoded(line):
    """{key: share} as AlphaEncodingService does it: letters or a bracket of them, then digits."""
    assert line.endswith(b"\n")
    found = re.findall(r"([A-Z]|\([A-Z]+\))(\d+)", line.decode())
    assert "".join(key + value for key, value in found) == line.decode().strip()
    return {key: int(value) / 4095 for key, value in found}


def test_the_struct_is_opengloves():
    assert ctypes.sizeof(V2PipeData) == SIZE == 120
    glove = glove_of(random_pose("left", 3))
    data = V2PipeData.from_buffer_copy(pipe_bytes(glove))
    for row, joints in zip(glove.flexion, data.flexion, strict=True):
        assert list(joints) == pytest.approx(row)
    assert list(data.splay) == pytest.approx(glove.splay)
    assert not any(getattr(data, name) for name in BUTTONS)
    assert (data.joyX, data.joyY, data.trgValue) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("hand", ["left", "right"])
def test_a_flat_hand_is_open_and_a_fist_closed(hand):
    flat = glove_of(pose_of([[0, -23, 0, 0], *[[0, 0, 0, 0]] * 4], hand))
    assert flat.flexion == [[0.0] * 4] * 5
    fist = glove_of(pose_of([[0, 30, 55, 80], *[[0, 90, 110, 90]] * 4], hand))
    assert np.array(fist.flexion) == pytest.approx(np.ones((5, 4)))
    # Each joint on its own, and what exceeds the range stays at its end.
    one = glove_of(pose_of([[0, -40, 0, 0], [0, 0, 55, 120], *[[0, 0, 0, 0]] * 3], hand))
    assert one.flexion[1] == pytest.approx([0.0, 0.0, 0.5, 1.0])
    assert one.flexion[0] == [0.0] * 4


@pytest.mark.parametrize("hand", ["left", "right"])
def test_splay_is_twenty_degrees_and_positive_away_from_the_thumb(hand):
    glove = glove_of(pose_of([[9, 0, 0, 0], [10, 0, 0, 0], [-5, 0, 0, 0], *[[-40, 0, 0, 0]] * 2]))
    assert glove.splay == pytest.approx([0.0, -0.5, 0.25, 1.0, 1.0])


def test_a_serial_line_says_the_same_in_letters():
    glove = glove_of(random_pose("right", 5))
    line = serial_line(glove)
    shares = decoded(line)
    for finger, joints, splay in zip("ABCDE", glove.flexion, glove.splay, strict=True):
        assert 2.0 * (shares[f"({finger}B)"] - 0.5) == pytest.approx(splay, abs=5e-4)
        assert shares[finger] == pytest.approx(np.mean(joints[1:]), abs=5e-4)
        for joint, share in list(zip("ABCD", joints, strict=True))[1:]:
            assert shares[f"({finger}A{joint})"] == pytest.approx(share, abs=5e-4)
    # 50 lines a second at 115200 baud, ten bits a byte.
    assert 50 * len(line) < 11_520
