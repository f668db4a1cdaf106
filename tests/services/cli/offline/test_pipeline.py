"""The order of frames of several cameras, and when 3D is possible."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.errors import CalibrationError
from rhot.files.config import load_rig
from services.cli.defaults import sim_toml
from services.cli.offline.pipeline import geometry, merged
from services.pi_tracker.image.frame import Frame

PICTURE = np.zeros((2, 2, 3), np.uint8)


def frames(camera, stamps):
    return [Frame(camera, i, stamp, 0.0, (2, 2), PICTURE, "bgr") for i, stamp in enumerate(stamps)]


@given(
    st.lists(st.sets(st.integers(0, 100), max_size=20).map(sorted), min_size=1, max_size=4),
    st.randoms(),
)
def test_frames_come_by_stamp_then_camera_whatever_the_order_of_cameras(stamps, random):
    streams = [frames(f"cam{number}", one) for number, one in enumerate(stamps)]
    expected = sorted((f.stamp_ns, f.camera) for stream in streams for f in stream)
    random.shuffle(streams)
    assert [(f.stamp_ns, f.camera) for f in merged(streams)] == expected


def test_two_calibrated_cameras_and_a_hand_give_3d():
    cameras, note = geometry(load_rig(sim_toml()), ["left", "right"])
    assert list(cameras) == ["left", "right"]
    assert not note


def test_one_camera_gives_markers_only():
    cameras, note = geometry(load_rig(sim_toml()), ["left"])
    assert cameras is None
    assert "two cameras, this is 'left' alone" in note


def test_a_camera_nobody_calibrated_is_an_error():
    with pytest.raises(CalibrationError, match="rhot calibrate"):
        geometry(load_rig(sim_toml()), ["left", "third"])
