"""Pairwise consistency of distance and size, and the most consistent set."""

from __future__ import annotations

from services.pi_tracker.identify.group_consistency import (
    Candidate,
    consistency,
    most_consistent_set,
)
from testing.synthetic_blobs import hand_blobs, square_blob


def test_consistent_markers_are_near_and_of_one_size():
    others = hand_blobs(300, 250)[:5]
    assert consistency(square_blob(5, 300, 310), others) > 0.6
    assert consistency(square_blob(5, 620, 20), others) < 0.15
    assert consistency(square_blob(5, 300, 310, 100), others) < 0.2
    assert consistency(square_blob(5, 300, 310), []) == 1.0


def test_the_most_consistent_set_of_nothing_is_nothing():
    assert most_consistent_set([]) == []
    assert most_consistent_set([[], []]) == [None, None]
    only = Candidate(square_blob(1, 50, 50), 0.5)
    assert most_consistent_set([[], [only]]) == [None, (only, 1.0)]
