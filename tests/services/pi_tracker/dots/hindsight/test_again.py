"""Searches that begin in the middle of a recording."""

from __future__ import annotations

from collections import Counter

import numpy as np

from services.pi_tracker.dots.dot import SeenPatches
from services.pi_tracker.dots.hindsight.again import searched_again
from services.pi_tracker.dots.search import LIVE
from services.pi_tracker.dots.tracker import DotTracker
from testing.dot_patches import NAMES, REST, SIZE, patches_at

COUNT = 50
RIGHT = tuple(range(8))


def _begin(seeds: dict[str, tuple[float, float]]) -> DotTracker:
    return DotTracker(NAMES, SIZE, seeds, LIVE, remembers=True)


def _pictures() -> list[SeenPatches]:
    moved = [REST + np.array([2.0, -1.0]) * k for k in range(COUNT)]
    return [SeenPatches(k / 30, patches_at(places)) for k, places in enumerate(moved)]


def test_both_directions_go_on_with_the_names_of_the_picture_they_begin_with() -> None:
    looks = Counter[str]()
    pictures, told = _pictures(), [RIGHT] * COUNT
    # Names are lost for a while; they are known before and after.
    told[5:30] = [(-1,) * 8] * 25
    found = searched_again(_begin, NAMES, pictures, told, lambda: looks.update("a"))
    assert len(found) == 2
    for account in found:
        assert dict(account) == dict.fromkeys(range(COUNT), RIGHT)
    assert looks["a"] == COUNT


def test_nothing_begins_where_no_picture_shows_every_dot_alone() -> None:
    hidden = [SeenPatches(one.time_s, one.patches[:7]) for one in _pictures()]
    merged, missing = (0, 1, 2, 6, 3, 4, 5, 6), (0, 1, 2, -1, 3, 4, 5, 6)
    for told in (merged, missing):
        assert searched_again(_begin, NAMES, hidden, [told] * COUNT, lambda: None) == []
    assert searched_again(_begin, NAMES, [], [], lambda: None) == []


def test_names_that_were_lost_for_good_are_found_again_by_shape() -> None:
    pictures = _pictures()
    exchanged = (4, 5, 6, 7, 0, 1, 2, 3)
    told = [RIGHT] * 5 + [exchanged] * (COUNT - 5)
    found = searched_again(_begin, NAMES, pictures, told, lambda: None)
    assert [account[COUNT - 1] for account in found].count(RIGHT) >= 2
    lost = [RIGHT] * 5 + [(-1,) * 8] * (COUNT - 5)
    found = searched_again(_begin, NAMES, pictures[5:], lost[5:], lambda: None)
    assert all(account == dict.fromkeys(range(COUNT - 5), RIGHT) for account in found)
    assert len(found) == 2
