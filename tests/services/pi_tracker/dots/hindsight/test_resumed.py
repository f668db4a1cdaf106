"""Searches that go on from where an account has the hand."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from rhot.hand import DIGITS
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.evidence import Judge, Told
from services.pi_tracker.dots.hindsight.resumed import LOOKS, resumed
from services.pi_tracker.dots.tracker import DotTracker, arrays_of
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints
from testing.dot_patches import NAMES, REST, SIZE, patches_at, patches_of, share_right
from testing.synthetic_dots import dot_frames, scene_of

COUNT = 45
RIGHT: Told = tuple(range(8))
FINGERS: Told = (4, 5, 6, 7, 0, 1, 2, 3)
NOTHING: Told = (-1,) * 8


def _judge() -> Judge:
    tracker = DotTracker(NAMES, SIZE)
    tracker.step(patches_at(REST), 0.0)
    assert tracker.begun is not None
    pictures = [arrays_of(patches_at(REST + np.array([4.0, -2.0]) * k)) for k in range(COUNT)]
    times = [k / 30 for k in range(COUNT)]
    return Judge(tracker.begun, pictures, times, [RIGHT] * COUNT)


def test_names_that_were_lost_for_good_are_found_from_where_they_were_right() -> None:
    for wrong in (FINGERS, NOTHING):
        lost = [RIGHT] * 25 + [wrong] * (COUNT - 25)
        assert resumed(_judge(), lost, lambda: None) == [RIGHT] * COUNT


def test_names_that_were_lost_for_a_while_are_found_between_those_that_stand() -> None:
    exchanged = [RIGHT] * 22 + [FINGERS] * 12 + [RIGHT] * (COUNT - 34)
    assert resumed(_judge(), exchanged, lambda: None) == [RIGHT] * COUNT


def test_right_names_stay_and_every_look_is_told() -> None:
    looks = Counter[str]()
    right = [RIGHT] * COUNT
    assert resumed(_judge(), right, lambda: looks.update("a")) == right
    assert looks["a"] == LOOKS * COUNT
    assert resumed(_judge(), [RIGHT], lambda: looks.update("a")) == [RIGHT]
    assert looks["a"] == LOOKS * (COUNT + 1)


def test_what_is_lost_where_a_fist_opens_is_found_in_part(rhot_data: Path) -> None:
    """A recorded hand with 15 dots; live, 67 % are right here, searched on 76 %."""
    recorded = load_recording(rhot_data / "hand_motion" / "leap" / "grab.csv")
    assert isinstance(recorded, RecordedJoints)
    dots = tuple((digit, joint) for digit in range(5) for joint in (1, 2, 3))
    names = [finger_landmarks(DIGITS[digit])[joint] for digit, joint in dots]
    frames = dot_frames(scene_of(recorded, dots, SIZE, 30.0, 3), 3)[48:97]
    seeds = {
        name: (float(x), float(y)) for name, (x, y) in zip(names, frames[0].places, strict=True)
    }
    tracker = DotTracker(names, SIZE, seeds, remembers=True)
    pictures, times = [], [k / 30 for k in range(len(frames))]
    for frame, time_s in zip(frames, times, strict=True):
        patches = patches_of(frame, tracker.dot_area_px2)
        pictures.append(arrays_of(patches))
        tracker.step(patches, time_s)
    live = [one.patch for one in tracker.way()]
    assert tracker.begun is not None
    told = resumed(Judge(tracker.begun, pictures, times, live), live, lambda: None)
    before, after = share_right(live, pictures, frames), share_right(told, pictures, frames)
    assert before < 0.8
    assert after > before + 0.05
