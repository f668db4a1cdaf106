"""How far a blob has gone since it was first seen."""

from __future__ import annotations

import pytest

from services.pi_tracker.identify.followed_blob import FollowedBlob, followed

FIRST = (20, 30, 28, 38)


def one_at(rect):
    """A blob that was first seen at FIRST, and is here now."""
    return FollowedBlob(FIRST, FIRST, (0.0, 0.0), 0, None).next(rect, (0.0, 0.0))


@pytest.mark.parametrize(
    ("rect", "stayed", "way"),
    [
        ((21, 30, 28, 39), True, None),
        # A hand covers one of its edges, or uncovers more of it.
        ((20, 30, 24, 38), True, None),
        ((20, 18, 28, 38), True, None),
        ((23, 30, 31, 38), False, None),
        ((27, 30, 35, 38), False, (7.0, 0.0)),
        ((20, 20, 27, 30), False, (-0.5, -9.0)),
    ],
)
def test_what_a_blob_has_gone_is_told_once_both_its_edges_have(rect, stayed, way):
    one = one_at(rect)
    assert (one.stayed, one.way) == (stayed, way)


def test_what_goes_with_the_hand_is_carried_and_what_does_not_is_not():
    start = FollowedBlob(FIRST, FIRST, (5.0, 5.0), 0, None)
    assert start.next((24, 30, 32, 38), (15.0, 5.0)).carried is None
    carried = start.next((27, 30, 35, 38), (15.0, 5.0))
    assert carried.carried is True
    assert carried.next((27, 30, 35, 38), (25.0, 5.0)).carried is True
    still = start.next((20, 30, 29, 38), (15.0, 5.0))
    assert still.carried is False
    assert still.next((23, 33, 31, 41), (8.0, 5.0)).carried is None


def test_blobs_are_those_of_the_frame_before_by_their_places():
    still, moving = (
        FollowedBlob(rect, rect, (0.0, 0.0), 3, None) for rect in (FIRST, (60, 60, 68, 68))
    )
    here, far, speck = (21, 30, 29, 38), (60, 74, 68, 83), (70, 60, 71, 62)
    same, carried, new = followed([still, moving], [here, far, speck], (0.0, 0.0), (0.0, 0.0))
    assert (same.first, same.frames) == (FIRST, 4)
    assert (carried.first, carried.way) == ((60, 60, 68, 68), (0.0, 14.5))
    assert (new.first, new.frames) == (speck, 0)
    # Farther than any hand moves, or of another size.
    for rect in ((60, 90, 68, 98), (60, 74, 80, 94)):
        (other,) = followed([moving], [rect], (0.0, 0.0), (0.0, 0.0))
        assert other.first == rect
