"""What is still missing of a registration's motion, told while somebody moves the tracker."""

from __future__ import annotations

import pytest

from services.calibrator.objects.guidance import motion_still_missing
from services.calibrator.objects.sightings import sightings
from services.calibrator.objects.tracker_path import tracker_path
from testing.synthetic_points import SyntheticRig
from testing.synthetic_tracker import COLOR, Lighthouse, TrackerMotion, painted_frames

RIG = SyntheticRig(sigma_px=0.3)


def missing(motion, seconds=20.0):
    seen = sightings(painted_frames(RIG, motion, (0.0, 0.03, 0.0), seconds), RIG.rig(), COLOR)
    return motion_still_missing(seen, tracker_path(Lighthouse().poses(motion, seconds)))


def test_a_good_recording_lacks_nothing():
    assert missing(TrackerMotion()) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"turn_rad": (0.0, 0.7, 0.0)}, "tilt it"),
        ({"size_m": (0.3, 0.0, 0.0)}, "move the tracker farther"),
        ({"size_m": (0.3, 0.3, 0.0)}, "nearer to the cameras"),
        ({"size_m": (0.4, 0.0, 0.4)}, "up and down"),
    ],
)
def test_each_lack_is_said_plainly(change, said):
    assert any(said in sentence for sentence in missing(TrackerMotion(**change)))


def test_time_that_is_left_is_told():
    assert any(sentence.startswith("10 s more") for sentence in missing(TrackerMotion(), 6.0))


def test_paint_or_tracker_out_of_sight_comes_first():
    motion = TrackerMotion()
    seen = sightings(painted_frames(RIG, motion, (0.0, 0.03, 0.0), 3.0), RIG.rig(), COLOR)
    path = tracker_path(Lighthouse().poses(motion, 3.0))
    assert "no camera sees" in motion_still_missing(seen.only(seen.camera == 5), path)[0]
    assert "camera right does not" in motion_still_missing(seen.only(seen.camera == 0), path)[0]
    assert "is not tracked" in motion_still_missing(seen, tracker_path([]))[0]
