"""Dots on rendered fingers: found at the seeds, followed, and told where they are missing."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.measure.dots.color import color_at, parse_range
from studies.grasp.measure.dots.finder import DotJoints, landmark_of
from studies.grasp.measure.recordings import Wanted, recordings
from studies.grasp.recording import JOINTS
from studies.grasp.scene.experiment import Experiment
from studies.grasp.scene.subjects import SUBJECTS
from studies.grasp.scene.truth import truth_of
from testing.grasp_pictures import frame_of


@pytest.fixture(scope="module")
def seen(pinch, pinch_seeds):
    _, frames = pinch
    finder = DotJoints(frames[0], pinch_seeds)
    return [finder.find(frame) for frame in frames]


def test_all_eight_dots_are_followed_to_a_fraction_of_a_pixel(pinch, pinch_seeds, seen):
    experiment, _ = pinch
    errors = []
    for number, picture in enumerate(seen):
        truth = experiment.pixels_of(number)
        for place, found in picture.places.items():
            at = truth[place.removeprefix("index_")]
            errors.append(np.hypot(*(at - (found.x_px, found.y_px))))
    assert len(errors) >= 0.97 * len(pinch_seeds) * len(seen)
    assert np.sqrt(np.mean(np.square(errors))) < 0.5


def test_angles_are_right_to_a_degree(pinch, pinch_seeds, seen):
    experiment, _ = pinch
    recording = recordings(seen, list(pinch_seeds), Wanted(), "dots", {})["index"].recording
    truth = truth_of(experiment)[0]
    for joint in ("pip", "dip"):
        errors = [
            np.degrees(frame.angles_rad[joint] - true.angles_rad[joint])
            for frame, true in zip(recording.frames, truth.frames, strict=True)
            if joint in frame.angles_rad
        ]
        assert np.sqrt(np.mean(np.square(errors))) < 1.0
    ratio = np.array(recording.lengths) / np.array(truth.lengths)
    assert np.ptp(ratio) / ratio.mean() < 0.02


def test_a_seed_without_a_dot_is_named(pinch, pinch_seeds):
    _, frames = pinch
    x, y = pinch_seeds["index_dip"]
    with pytest.raises(CaptureError, match=r"seed index_dip=\d+,\d+: no dot there"):
        DotJoints(frames[0], {**pinch_seeds, "index_dip": (x - 8.0, y + 60.0)})
    with pytest.raises(CaptureError, match="on the same dot"):
        DotJoints(frames[0], {**pinch_seeds, "index_dip": pinch_seeds["index_pip"]})


def test_no_hand_and_no_dots_are_told(pinch, pinch_seeds):
    _, frames = pinch
    empty = replace(frames[0], image=np.full_like(frames[0].image, 180))
    with pytest.raises(CaptureError, match="no dots at the seeds"):
        DotJoints(empty, pinch_seeds)
    with pytest.raises(CaptureError, match="no hand: there is not one dot of that colour"):
        DotJoints(empty, pinch_seeds, parse_range("50,80,40-80,255,255"))


def test_a_dot_that_leaves_the_picture_or_is_covered(pinch, pinch_seeds):
    _, frames = pinch
    finder = DotJoints(frames[0], pinch_seeds)
    finder.find(frames[0])
    covered = frames[1].image.copy()
    x, y = map(round, pinch_seeds["thumb_tip"])
    cv2.circle(covered, (x, y), 20, (120, 140, 170), cv2.FILLED)
    picture = finder.find(replace(frames[1], image=covered))
    assert picture.lost == {"thumb_tip": "its dot is not seen"}
    assert len(picture.places) == 7


def test_the_dots_own_colour_is_found_at_the_seeds(pinch, pinch_seeds):
    _, frames = pinch
    color = color_at(frames[0], pinch_seeds)
    assert 40 <= color.hsv_low[0] <= color.hsv_high[0] <= 90
    grey = np.repeat(cv2.cvtColor(frames[0].image, cv2.COLOR_BGR2GRAY)[..., None], 3, axis=2)
    assert color_at(replace(frames[0], image=grey), pinch_seeds) is None


def test_faint_dots_are_known_by_what_is_right_under_the_clicks(pinch_options):
    """Red on dark skin, in a shadow, blurred and compressed: such patches run into the skin."""
    experiment = Experiment(SUBJECTS[4], pinch_options._replace(dots="red"), 3)
    shade = np.linspace(0.5, 1.1, 480)[None, :, None]
    finder = None
    for number in range(3):
        picture = cv2.GaussianBlur(experiment.picture(number), (0, 0), 1.0) * shade
        coded = cv2.imencode(".jpg", picture.clip(0, 255).astype(np.uint8), [1, 35])[1]
        frame = frame_of(cv2.imdecode(coded, cv2.IMREAD_COLOR), number)
        truth = experiment.pixels_of(number)
        truth = {n if n[0:5] == "thumb" else f"index_{n}": at for n, at in truth.items()}
        truth.pop("index_base")
        seeds = {place: tuple(at.tolist()) for place, at in truth.items()}
        if finder is None:
            finder = DotJoints(frame, seeds)
        places = finder.find(frame).places
        assert len(places) == 8
        for place, found in places.items():
            assert np.hypot(*(truth[place] - (found.x_px, found.y_px))) < 1.5


def test_black_dots_as_the_papers_are_followed_as_well(pinch_options):
    experiment = Experiment(SUBJECTS[0], pinch_options._replace(dots="black", thumb=False), 22)
    seeds = {
        landmark: tuple(experiment.pixels_of(0)[joint].tolist())
        for landmark, joint in (("index_wrist", "base"), *((f"index_{j}", j) for j in JOINTS))
    }
    finder = None
    for number in range(5):
        frame = frame_of(experiment.picture(number), number)
        finder = finder or DotJoints(frame, seeds)
        places = finder.find(frame).places
        assert len(places) == 5
        for place, joint in zip(seeds, ("base", *JOINTS), strict=True):
            found = places[place]
            at = experiment.pixels_of(number)[joint]
            assert np.hypot(*(at - (found.x_px, found.y_px))) < 1.0


@pytest.mark.parametrize("text", ["1,2,3", "200,0,0-10,255,255", "0,90,0-10,80,255"])
def test_a_range_that_is_none(text):
    with pytest.raises(CaptureError, match="--hsv"):
        parse_range(text)


def test_regions_of_edges_are_no_dots():
    assert landmark_of("index_wrist") == "index_metacarpal"
    with pytest.raises(CaptureError, match="edges method"):
        landmark_of("index_b1")
