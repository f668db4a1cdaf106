"""Dots keep their names: through crossings, gaps, false patches and jerks."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import DIGITS
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.dot import Dot, Patch
from services.pi_tracker.dots.tracker import DotTracker
from testing.dot_patches import NAMES, REST, SIZE, patches_at

JOINTS_OF_FINGERS = tuple(name for digit in DIGITS for name in finger_landmarks(digit))


def _tracker(names: tuple[str, ...] = NAMES, rest: np.ndarray = REST) -> DotTracker:
    tracker = DotTracker(names, SIZE, {n: (x, y) for n, (x, y) in zip(names, rest, strict=True)})
    tracker.step(patches_at(rest), 0.0)
    return tracker


def _errors(dots: dict[str, Dot], truth: np.ndarray) -> np.ndarray:
    return np.array(
        [
            np.hypot(dots[n].x_px - x, dots[n].y_px - y)
            for n, (x, y) in zip(NAMES, truth, strict=True)
        ]
    )


def test_seeds_name_the_patches_beside_them_whatever_their_order() -> None:
    seeds = {n: (x + 4.0, y - 3.0) for n, (x, y) in zip(NAMES, REST, strict=True)}
    tracker = DotTracker(NAMES, SIZE, seeds)
    order = np.random.default_rng(1).permutation(8)
    dots = tracker.step(patches_at(REST[order]), 0.0)
    assert list(dots) == list(NAMES)
    assert _errors(dots, REST).max() == 0.0
    assert [order[dots[name].patch] for name in NAMES] == list(range(8))
    assert not tracker.notes


def test_a_seed_without_a_dot_is_told_and_waits() -> None:
    seeds = {n: (x, y) for n, (x, y) in zip(NAMES, REST, strict=True)}
    tracker = DotTracker(NAMES, SIZE, seeds)
    dots = tracker.step(patches_at(REST[:7]), 0.0)
    assert dots["index_tip"].state == "carried"
    assert "no dot at the seed of index tip" in tracker.notes[0]
    dots = tracker.step(patches_at(REST), 1 / 30)
    assert dots["index_tip"].state == "seen"


def test_wrong_names_are_refused() -> None:
    with pytest.raises(ValueError, match="no landmark"):
        DotTracker(("index_knuckle",), SIZE, {})
    with pytest.raises(ValueError, match="none of the dots"):
        DotTracker(NAMES, SIZE, {"little_tip": (1.0, 2.0)})


def test_tips_that_cross_keep_their_names() -> None:
    tracker = _tracker()
    for frame in range(1, 41):
        truth = REST.copy()
        # The thumb's tip goes up past the index finger's, which goes down: 6 px a frame each.
        share = frame / 40.0
        truth[3] += share * np.array([110.0, -170.0])
        truth[2] += share * np.array([40.0, -70.0])
        truth[7] += share * np.array([-90.0, 150.0])
        truth[6] += share * np.array([-30.0, 60.0])
        apart = np.linalg.norm(truth[3] - truth[7])
        patches = patches_at(truth)
        if apart < 16.0:
            patches = patches_at(np.delete(truth, [3, 7], axis=0)) + patches_at(
                0.5 * (truth[3:4] + truth[7:8])
            )
        dots = tracker.step(patches, frame / 30)
        assert _errors(dots, truth).max() < 12.0


def test_a_hand_that_jerks_by_more_than_its_dots_are_apart_keeps_them() -> None:
    tracker = _tracker()
    truth = REST
    for frame in range(1, 12):
        if frame == 6:
            truth = REST + np.array([70.0, -20.0])
        dots = tracker.step(patches_at(truth), frame / 30)
        assert _errors(dots, truth).max() < 1.0


def test_a_lost_dot_is_found_again_and_no_false_patch_is_taken_for_it() -> None:
    tracker = _tracker()
    for frame in range(1, 60):
        truth = REST + np.array([3.0, 1.0]) * min(frame, 40)
        seen = truth if not 20 <= frame < 35 else np.delete(truth, 5, axis=0)
        patches = patches_at(seen)
        if 10 <= frame < 50:
            patches.append(Patch(300.0, 300.0, 280.0))
        dots = tracker.step(patches, frame / 30)
        assert _errors(dots, truth).max() < 12.0
        assert dots["index_intermediate"].state == ("carried" if 20 <= frame < 35 else "seen")


def test_a_hand_that_comes_back_elsewhere_is_found_as_it_was_known() -> None:
    """Its account has followed what was left of it, one dot, to somewhere else meanwhile."""
    tracker = _tracker()
    for frame in range(1, 10):
        tracker.step(patches_at(REST), frame / 30)
    stays = Patch(REST[0, 0], REST[0, 1], 300.0)
    for frame in range(10, 70):
        # What is taken for the thumb's root wanders off; then the hand is there again.
        stays = Patch(stays.x_px + 3.0, stays.y_px - 3.0, 300.0)
        tracker.step([stays], frame / 30)
    middle = REST.mean(axis=0)
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    back = middle + (REST - middle) @ turn + np.array([40.0, 30.0])
    for frame in range(70, 82):
        dots = tracker.step(patches_at(back), frame / 30)
    assert _errors(dots, back).max() < 1.0


def test_a_hand_that_is_lost_right_after_the_start_is_found_as_it_began() -> None:
    """Expected: what tracking starts with is known, also if it is seen in two pictures only."""
    tracker = _tracker()
    tracker.step(patches_at(REST), 1 / 30)
    for frame in range(2, 12):
        tracker.step([], frame / 30)
    back = REST + np.array([150.0, 90.0])
    for frame in range(12, 24):
        dots = tracker.step(patches_at(back), frame / 30)
    assert {dot.state for dot in dots.values()} == {"seen"}
    assert _errors(dots, back).max() < 1.0


def test_how_large_a_dot_is_as_a_whole_is_told_by_those_that_face_the_camera() -> None:
    """Expected: 300 px^2 of the index finger's, whatever the thumb's show that face aside."""
    thumb = [Patch(x, y, 80.0) for x, y in REST[:4].tolist()]
    tracker = DotTracker(NAMES, SIZE, {n: (x, y) for n, (x, y) in zip(NAMES, REST, strict=True)})
    for frame in range(10):
        tracker.step(thumb + patches_at(REST[4:]), frame / 30)
    assert tracker.dot_area_px2 > 280.0


def test_dots_that_are_half_hidden_do_not_make_a_whole_one_large() -> None:
    tracker = _tracker()
    for frame in range(1, 20):
        patches = patches_at(REST[:2])
        patches += [Patch(x, y, 300.0 - 14.0 * frame) for x, y in REST[2:].tolist()]
        tracker.step(patches, frame / 30)
        assert tracker.dot_area_px2 > 250.0


def test_no_patches_at_all_is_no_error_and_time_may_stand_still() -> None:
    tracker = _tracker()
    dots = tracker.step([], 1 / 30)
    assert {dot.state for dot in dots.values()} == {"carried"}
    assert {dot.state for dot in tracker.step(patches_at(REST), 1 / 30).values()} == {"seen"}
    assert DotTracker(NAMES, SIZE, {}).step([], 0.0) == {}


@pytest.mark.parametrize("landmarks", [NAMES, JOINTS_OF_FINGERS])
def test_without_seeds_the_constellation_names_the_dots(landmarks: tuple[str, ...]) -> None:
    """Also where rig.toml leaves open which fingers have dots, and with a speck among them."""
    tracker = DotTracker(landmarks, SIZE)
    assert tracker.step(patches_at(REST[:5]), 0.0) == {}
    order = np.random.default_rng(2).permutation(8)
    dots = tracker.step([Patch(620.0, 300.0, 16.0), *patches_at(REST[order])], 1 / 30)
    assert set(dots) == set(NAMES)
    assert _errors(dots, REST).max() == 0.0
    assert not tracker.notes
