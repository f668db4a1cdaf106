"""Grasps: opposed contacts, things that move along, and what is neither."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_x, transform
from rhot.hand_skin import PARTS
from services.object_tracker.contacts.distances import PartDistance
from services.object_tracker.contacts.grasp import GraspTracker, opposed
from services.object_tracker.contacts.touch import TouchTracker

START, FRAME_NS = 10**18, 33_333_333


def contact(part, angle_deg):
    """On a cup of 70 mm, at an angle about its axis."""
    normal = np.array([np.cos(np.deg2rad(angle_deg)), 0.0, np.sin(np.deg2rad(angle_deg))])
    return PartDistance(part, 0.0, 0.001, 0.035 * normal, normal, predicted=False)


@pytest.mark.parametrize(
    ("angles", "pairs"),
    [
        ({"thumb": 0, "index": 180}, 1),
        ({"thumb": 0, "index": 120, "middle": 150}, 2),
        ({"palm": 0, "ring": 170}, 1),
        # Beside each other, all on one side, or two fingers without thumb and palm.
        ({"thumb": 0, "index": 30}, 0),
        ({"thumb": 0}, 0),
        ({"index": 0, "ring": 180}, 0),
    ],
)
def test_what_presses_from_opposite_sides(angles, pairs):
    touching = {part: contact(part, angle) for part, angle in angles.items()}
    assert len(opposed(touching)) == pairs


class Held:
    """A grasp tracker, fed frame by frame."""

    def __init__(self):
        self.tracker, self.frame = GraspTracker(), 0
        self.touches = {part: TouchTracker() for part in PARTS}

    @property
    def stamp_ns(self):
        return START + self.frame * FRAME_NS

    def run(self, frames, angles, move_m=0.0, slip_m=0.0, turn_rad=0.0):
        """That many frames; the hand moves by move_m a frame, the object slips in it by slip_m."""
        for _ in range(frames):
            self.frame += 1
            for part, touch in self.touches.items():
                if touch.touching != (part in angles):
                    touch.touching = part in angles
                    if touch.touching:
                        touch.since_ns = self.stamp_ns
                    else:
                        touch.since_ns, touch.until_ns = 0, self.stamp_ns
            n = self.frame
            hand = transform(rotation_x(turn_rad * n), [move_m * n, 0.0, 0.5])
            item = transform(np.eye(3), [slip_m * n, -0.05, 0.0])
            distances = [contact(part, angles.get(part, 0.0)) for part in PARTS]
            self.tracker.step(self.stamp_ns, distances, self.touches, hand @ item, hand)
        return self.tracker.holding


def test_a_pinch_is_a_grasp_since_both_touch():
    held = Held()
    assert not held.run(5, {"thumb": 0})
    since_ns = held.stamp_ns + FRAME_NS
    assert held.run(4, {"thumb": 0, "index": 175})
    assert held.tracker.since_ns == since_ns
    assert set(held.tracker.parts) == {"thumb", "index"}
    assert not held.run(5, {"thumb": 0})
    assert held.tracker.began_ns == since_ns
    assert held.tracker.until_ns == since_ns + 4 * FRAME_NS


def test_one_frame_of_opposition_is_none_and_one_without_it_ends_none():
    held = Held()
    assert not held.run(1, {"thumb": 0, "index": 175})
    assert not held.run(3, {})
    assert held.run(10, {"thumb": 0, "index": 175})
    assert held.run(1, {"thumb": 0})
    assert held.run(1, {"thumb": 0, "index": 175})
    assert held.tracker.until_ns == 0


def test_what_still_touches_after_a_grasp_must_oppose_anew_for_as_long():
    held = Held()
    assert held.run(10, {"thumb": 0, "index": 175, "palm": 140})
    assert not held.run(5, {"index": 175, "palm": 140})
    # The index slides on and lies against the palm for a frame.
    assert not held.run(1, {"index": 200, "palm": 20})
    assert not held.run(4, {"palm": 20})
    assert held.tracker.until_ns > 0


def test_a_touched_thing_that_moves_with_the_hand_is_held():
    held = Held()
    assert not held.run(10, {"index": 0})
    assert held.run(15, {"index": 0}, move_m=0.004)
    # Let go: nothing touches, however it moves.
    assert not held.run(6, {}, move_m=0.004)


def test_a_thing_that_slips_under_the_finger_is_not():
    held = Held()
    assert not held.run(30, {"index": 0}, move_m=0.004, slip_m=0.002)


def test_a_thing_that_turns_with_the_hand_is_held():
    held = Held()
    assert held.run(20, {"palm": 0}, turn_rad=0.05)
