"""A recording as arrays: what it leaves out is taken from what it has, and odd ones are told."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.recording import GraspFrame, GraspRecording
from studies.grasp.track import finger_lengths, finger_track, implausible, track_of_columns
from testing.synthetic_fingers import PEOPLE, Motion, recorded_person

MADE = recorded_person(PEOPLE[1], Motion(cycles=1, fps=20.0))


def changed(**fields) -> GraspRecording:
    frames = [msgspec.structs.replace(frame, **fields) for frame in MADE.frames]
    return msgspec.structs.replace(MADE, frames=frames)


def test_angles_and_direction_come_from_the_points():
    full = finger_track(MADE)
    bare = finger_track(changed(angles_rad={}, tip_direction_rad=None))
    assert bare.angles_rad == pytest.approx(full.angles_rad, abs=1e-6)
    # Beyond half a turn: a fist's tip points back at the wrist.
    assert full.direction_rad.max() > np.deg2rad(200.0)
    assert bare.direction_rad == pytest.approx(full.direction_rad, abs=1e-6)


def test_a_direction_alone_is_unwrapped():
    wrapped = [
        msgspec.structs.replace(
            frame,
            angles_rad={},
            points={"tip": frame.points["tip"]},
            tip_direction_rad=float(np.angle(np.exp(1j * frame.tip_direction_rad))),
        )
        for frame in MADE.frames
    ]
    track = finger_track(msgspec.structs.replace(MADE, frames=wrapped))
    assert track.direction_rad == pytest.approx(finger_track(MADE).direction_rad, abs=1e-6)
    assert np.isnan(track.angles_rad).all()


def test_frames_without_a_finger_and_repeated_times_are_left_out():
    lost = [GraspFrame(frame=99, time_s=0.07, confidence=0.0, note="out of view"), MADE.frames[0]]
    track = finger_track(msgspec.structs.replace(MADE, frames=[*MADE.frames, *lost]))
    assert len(track.times_s) == len(MADE.frames)
    assert (np.diff(track.times_s) > 0.0).all()
    assert track.notes


def test_columns_go_there_and_back():
    track = finger_track(MADE)
    back = track_of_columns(track.times_s, track.columns())
    assert back.joints == pytest.approx(track.joints)
    assert back.direction_rad == pytest.approx(track.direction_rad)


def test_lengths_of_the_recording_or_of_its_joints():
    track = finger_track(MADE)
    assert finger_lengths(MADE, track)[0] == pytest.approx(PEOPLE[1].lengths_mm)
    without = msgspec.structs.replace(MADE, lengths=None)
    found, origin = finger_lengths(without, track)
    assert found == pytest.approx(PEOPLE[1].lengths_mm)
    assert "medians" in origin
    tips = changed(points={"tip": (80.0, 1.0)})
    tips = msgspec.structs.replace(tips, lengths=None)
    assert finger_lengths(tips, finger_track(tips))[0] is None


@pytest.mark.parametrize(
    ("factor", "guess"), [(1e-3, "metres"), (0.1, "centimetres"), (1e3, "micrometres"), (20.0, "")]
)
def test_metres_for_millimetres(factor, guess):
    told = implausible(MADE, factor * np.array(PEOPLE[1].lengths_mm))
    assert "fingers are 25 to 160 mm" in told
    assert (f"{guess} written as mm?" in told) == bool(guess)
    assert implausible(MADE, np.array(PEOPLE[1].lengths_mm)) == ""
    in_px = msgspec.structs.replace(MADE, unit="px")
    assert implausible(in_px, np.array([400.0, 300.0, 200.0])) == ""


def test_too_few_frames_and_degrees_for_radians():
    few = msgspec.structs.replace(MADE, frames=MADE.frames[:5])
    with pytest.raises(CaptureError, match="5 of 5 frames have a finger"):
        finger_track(few)
    still = changed(time_s=1.0)
    with pytest.raises(CaptureError, match="1 different times"):
        finger_track(still)
    with pytest.raises(CaptureError, match="Were degrees written"):
        finger_track(changed(angles_rad={"pip": 95.0}))
