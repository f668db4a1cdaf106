"""Searches that go on from where an account has the hand."""

from __future__ import annotations

from collections import Counter

import numpy as np

from services.pi_tracker.dots.evidence import Judge, Told
from services.pi_tracker.dots.hindsight.resumed import LOOKS, resumed
from services.pi_tracker.dots.tracker import DotTracker, arrays_of
from testing.dot_patches import NAMES, REST, SIZE, patches_at

COUNT = 60
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
