"""The order of frames of several cameras, and when 3D is possible."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.errors import CalibrationError
from rhot.files.config import load_rig
from services.cli.defaults import sim_toml
from services.cli.offline.pipeline import Pipeline, geometry, merged
from services.pi_tracker.image.frame import Frame
from testing.point_errors import point_errors
from testing.synthetic_points import MovingHand, SyntheticRig, point_hands
from testing.synthetic_points import frames as marker_frames

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


def test_a_second_pass_knows_from_its_first_frame_on_how_cameras_are_tilted(monkeypatch):
    monkeypatch.setattr(
        "services.cli.offline.pipeline.load_hand", lambda *_: point_hands()["right"]
    )
    rig, motion = SyntheticRig(tilt_rad=np.deg2rad(0.25)), MovingHand(speed_m_s=0.5)
    given_frames = marker_frames(rig, motion, 4.0)
    first = Pipeline(rig.config(), rig.rig())
    rms_m = []
    for pipeline in (first, first):
        passed = pipeline if not rms_m else pipeline.again()
        told = [points for output in passed.outputs(given_frames) for points in output.points]
        found = point_errors([m for m in told if m.points], motion)
        early = found.instants_s < found.instants_s.min() + 0.8
        rms_m.append(float(np.sqrt(np.mean(np.sum(found.errors_m[early] ** 2, axis=1)))))
    assert rms_m[1] < 0.7 * rms_m[0]
    # .25 deg of 527 px of focal length.
    [text] = first.tilts
    assert text.startswith("the views of left and right differ by 2.3 px in height")
