"""Pairwise consistency of distance and size, and the most consistent set."""

from __future__ import annotations

from services.pi_tracker.identify.group_consistency import Candidate, most_consistent_set
from services.pi_tracker.identify.hand_layout import HandLayout
from testing.synthetic_blobs import COLORS, hand_blobs, square_blob

UNKNOWN = HandLayout(COLORS, {})


def consistency(blob, others):
    """Of a blob with others, one of each colour."""
    blobs = [*others, blob]
    return most_consistent_set([[Candidate(one, 1.0)] for one in blobs], UNKNOWN)[-1][1]


def test_consistent_markers_are_near_and_of_one_size():
    others = hand_blobs(300, 250)[:5]
    assert consistency(square_blob(5, 300, 310), others) > 0.6
    assert consistency(square_blob(5, 620, 20), others) < 0.15
    assert consistency(square_blob(5, 300, 310, 100), others) < 0.2
    assert consistency(square_blob(5, 300, 310), []) == 1.0


def test_the_most_consistent_set_of_nothing_is_nothing():
    assert most_consistent_set([], UNKNOWN) == []
    assert most_consistent_set([[], []], UNKNOWN) == [None, None]
    only = Candidate(square_blob(1, 50, 50), 0.5)
    assert most_consistent_set([[], [only]], UNKNOWN) == [None, (only, 1.0)]


def test_of_things_that_are_as_near_and_as_large_the_layout_of_a_hand_wins():
    """The thumb's tip and the wrist's dab among the fingers, and they where those are."""
    marked = ("thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip", "wrist")
    layout = HandLayout(
        COLORS, {color: ("left", name) for color, name in zip(COLORS, marked, strict=True)}
    )
    tips, places = hand_blobs(300, 250), hand_blobs(500, 250)
    exchanged = [places[n]._replace(color=color) for color, n in enumerate((2, 5, 1, 0, 4, 3))]
    candidates = [
        [Candidate(thing, 1.0), Candidate(tip, 1.0)]
        for tip, thing in zip(tips, exchanged, strict=True)
    ]
    found = most_consistent_set(candidates, layout)
    assert [member.blob for member, _ in found] == tips
    found = most_consistent_set(candidates, UNKNOWN)
    assert [member.blob for member, _ in found] != tips
