"""Dots of fingers that move sharply keep their names, and specks are none of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rhot.hand import DIGITS
from services.pi_tracker.dots.body.rotations import turned
from services.pi_tracker.dots.body.skeleton import Skeleton
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.dot import Patch
from services.pi_tracker.dots.search import LIVE, SEVERAL, Search
from services.pi_tracker.dots.tracker import DotTracker
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints
from testing.dot_patches import SIZE, patches_of
from testing.synthetic_dots import DotFrame, dot_frames, scene_of

NAMES = ("wrist", "index_proximal", "index_intermediate", "index_distal", "index_tip")
# A finger that closes within four pictures at 12 Hz, as rendered: wrist to tip.
CLOSING = (
    [(126, 152), (211, 150), (291, 151), (335, 158), (371, 168)],
    [(125, 153), (210, 151), (290, 152), (328, 175), (353, 204)],
    [(124, 154), (209, 151), (284, 178), (291, 222), (272, 254)],
    [(123, 154), (208, 152), (238, 226), (195, 242), (167, 218)],
    [(122, 155), (207, 152), (213, 232), (169, 224), (162, 188)],
)


def _patches(places: object) -> list[Patch]:
    return [Patch(float(x), float(y), 85.0) for x, y in np.asarray(places)]


def _tracker() -> DotTracker:
    seeds = {name: (float(x), float(y)) for name, (x, y) in zip(NAMES, CLOSING[0], strict=True)}
    return DotTracker(NAMES, (480, 360), seeds)


def test_a_finger_that_closes_at_once_keeps_all_its_dots() -> None:
    tracker = _tracker()
    for number, places in enumerate(CLOSING):
        dots = tracker.step(_patches(places), number / 12.0)
        for name, (x, y) in zip(NAMES, places, strict=True):
            assert (round(dots[name].x_px), round(dots[name].y_px)) == (x, y), (number, name)
            assert dots[name].state == "seen"


def test_a_speck_that_was_there_before_is_no_lost_dot() -> None:
    tracker, speck = _tracker(), (345, 235)
    for number in range(4):
        tracker.step(_patches([*CLOSING[0], speck]), number / 30.0)
    for number in range(4, 10):
        dots = tracker.step(_patches([*CLOSING[0][:4], speck]), number / 30.0)
        assert dots["index_tip"].state == "carried"
        assert np.hypot(dots["index_tip"].x_px - 371, dots["index_tip"].y_px - 168) < 30.0


def test_fingers_that_all_close_within_a_fifth_of_a_second_keep_their_names() -> None:
    """15 dots, the last pictures without the little finger's, which its neighbours hide."""
    names = [name for digit in DIGITS for name in finger_landmarks(digit)[1:]]
    skeleton, order = Skeleton(names, (1280, 720)), np.random.default_rng(1).permutation(15)
    tracker = None
    for number, bend in enumerate((0.0, 0.0, 0.0, 0.1, 0.4, 0.8, 1.1, 1.2, 1.1, 0.9, 0.7)):
        posture = np.zeros((1, skeleton.size))
        posture[0, :3] = 0.02, 0.01, 0.4
        posture[0, 6 : skeleton.moving] = np.tile([0.0, 0.2, 0.2, 0.15], 5)
        posture[0, 10 : skeleton.moving] += bend * np.tile([0.0, 1.0, 1.0, 0.6], 4)
        turn = turned(np.array([[1.4, 0.5, 0.1]]))
        if tracker is None:
            facing = skeleton.facing(posture, turn, np.ones(1))
        truth = skeleton.project(posture, turn, np.ones(1), facing)[0][0]
        shown = [dot for dot in order if dot < 12 or not 5 <= number <= 7]
        if tracker is None:
            tracker = DotTracker(
                names, (1280, 720), {n: (x, y) for n, (x, y) in zip(names, truth, strict=True)}
            )
        dots = tracker.step(_patches(truth[shown]), number / 30.0)
        assert [dots[names[k]].patch for k in shown] == list(range(len(shown))), number


def test_postures_that_look_wrong_at_first_are_kept_where_they_are_searched_apart(
    rhot_data: Path,
) -> None:
    """A recorded hand with 15 dots, of which one picture allows several postures."""
    recorded = load_recording(rhot_data / "hand_motion" / "leap" / "grab.csv")
    assert isinstance(recorded, RecordedJoints)
    dots = tuple((digit, joint) for digit in range(5) for joint in (1, 2, 3))
    frames = dot_frames(scene_of(recorded, dots, SIZE, 30.0, 6), 6)[:12]
    assert _postures(frames, SEVERAL[0]) > _postures(frames, LIVE)


def _postures(frames: list[DotFrame], search: Search) -> int:
    """Of how many postures of the first picture accounts are kept after the last."""
    names = [name for digit in DIGITS for name in finger_landmarks(digit)[1:]]
    seeds = {n: (float(x), float(y)) for n, (x, y) in zip(names, frames[0].places, strict=True)}
    tracker = DotTracker(names, SIZE, seeds, search)
    for number, frame in enumerate(frames):
        tracker.step(patches_of(frame, tracker.dot_area_px2), number / 30.0)
    return len({one.branch for one in tracker._hypotheses})
