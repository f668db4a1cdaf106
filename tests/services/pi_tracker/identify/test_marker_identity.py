"""Data association: which blob is the marker."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.identify import group_consistency
from services.pi_tracker.identify.marker_identity import MarkerIdentity
from testing.synthetic_blobs import (
    COLORS,
    FRAME_NS,
    START_NS,
    associated,
    filled_blob,
    hand_blobs,
    nothing_known,
    square_blob,
)


def among_specks(tips, side_px, seed):
    """Each tip after 400 specks of its own colour."""
    random = np.random.default_rng(seed)
    places = [random.uniform(20, 460, (400, 2)).tolist() for _ in tips]
    return [
        [*(square_blob(tip.color, x, y, side_px) for x, y in own), tip]
        for own, tip in zip(places, tips, strict=True)
    ]


def test_a_hand_is_preferred_to_larger_things_in_the_background():
    tips = hand_blobs(400, 250)
    things = [
        square_blob(0, 60, 60, 40),
        square_blob(1, 600, 60, 36),
        square_blob(2, 60, 420, 34),
        square_blob(5, 80, 240, 44),
    ]
    blobs = [[one for one in things + tips if one.color == color] for color in range(6)]
    assert associated(MarkerIdentity(COLORS, 40), blobs, 0) == tips


def test_a_hand_is_told_from_things_that_are_consistent_too():
    tips = hand_blobs(430, 250)
    things = [square_blob(color, 80 + 15 * color, 100 + 60 * (color % 3), 36) for color in range(4)]
    blobs = [[one for one in things + tips if one.color == color] for color in range(6)]
    assert associated(MarkerIdentity(COLORS, 40), blobs, 0) == tips


def test_a_marker_half_occluded_by_another_is_known_by_its_place():
    """A few cells beside a larger blob are its rim as a rule, but not where the marker must be."""
    identity = MarkerIdentity(COLORS, 40)
    for seq in range(5):
        tips = hand_blobs(300 + 9 * seq, 250)
        associated(identity, [[tip] for tip in tips], seq)
    tips = hand_blobs(345, 250)
    x1, y0 = tips[2].rect[2], tips[2].rect[1]
    sliver = filled_blob(1, (x1, y0, x1 + 2, y0 + 4))
    rim = filled_blob(5, (x1, y0 + 4, x1 + 2, y0 + 7))
    blobs = [[tip] for tip in tips]
    blobs[5].append(rim)
    blobs[1] = [sliver]
    blobs[2] = [tips[2]]
    found = associated(identity, blobs, 5)
    assert found[5] == tips[5]
    # Forty pixels from where it was.
    assert found[1] is None
    near = filled_blob(1, (*tips[1].rect[:2], tips[1].rect[0] + 2, tips[1].rect[1] + 4))
    blobs[1] = [near]
    blobs[2] = [square_blob(2, near.rect[2] * 2 + 7, near.rect[1] * 2 + 7)]
    assert associated(identity, blobs, 5)[1] == near


def test_an_occluded_marker_coasts_with_the_hand():
    identity = MarkerIdentity(COLORS, 40)
    for seq in range(3):
        associated(identity, [[tip] for tip in hand_blobs(200 + 20 * seq, 250)], seq)
    for seq in range(3, 8):
        tips = hand_blobs(200 + 20 * seq, 250)
        associated(identity, [[tip] if color != 3 else [] for color, tip in enumerate(tips)], seq)
    tips = hand_blobs(200 + 20 * 8, 250)
    sliver = filled_blob(3, (*tips[3].rect[:2], tips[3].rect[0] + 2, tips[3].rect[1] + 4))
    beside = square_blob(2, sliver.rect[0] * 2 - 7, sliver.rect[1] * 2 + 4)
    blobs = [[tip] for tip in tips]
    blobs[3], blobs[2] = [sliver], [beside]
    assert associated(identity, blobs, 8)[3] == sliver


def test_the_occluded_fraction_of_a_marker_is_told():
    identity = MarkerIdentity(COLORS[:2], 40)
    left, right = square_blob(0, 100, 100), square_blob(1, 160, 100)
    for seq in range(4):
        associated(identity, [[left], [right]], seq)
    near = square_blob(1, 112, 100)
    stamp_ns = START_NS + 4 * FRAME_NS
    assert None not in identity.associate([[left], [near]], stamp_ns, nothing_known)
    whole_px2 = left.area_px
    at, half_px2 = (left.x_px, left.y_px), 0.5 * whole_px2
    assert identity.update(0, *at, half_px2, whole_px2, stamp_ns) == pytest.approx(0.5)
    # Nothing touches it: it turns away.
    for share, occluded in ((0.9, 0.0), (0.8, 0.0), (0.7, 0.0), (0.4, 0.5)):
        stamp_ns += FRAME_NS
        assert None not in identity.associate([[left], [right]], stamp_ns, nothing_known)
        told = identity.update(0, *at, share * whole_px2, whole_px2, stamp_ns)
        assert told == pytest.approx(occluded, abs=0.1)


def test_a_lost_marker_is_found_again_in_the_next_frame_that_shows_it():
    identity = MarkerIdentity(COLORS, 40)
    for seq in range(5):
        associated(identity, [[tip] for tip in hand_blobs(300, 250)], seq)
    for seq in range(5, 40):
        associated(identity, [[] for _ in range(6)], seq)
    tips = hand_blobs(150, 150)
    assert associated(identity, [[tip] for tip in tips], 40) == tips


def test_a_wrong_first_association_is_corrected():
    identity = MarkerIdentity(COLORS, 40)
    thing = square_blob(5, 80, 240, 40)
    tips = hand_blobs(400, 250)
    associated(identity, [[], [], [], [], [], [thing]], 0)
    found = associated(
        identity, [[tip] if color != 5 else [thing, tip] for color, tip in enumerate(tips)], 1
    )
    assert found == tips


def test_a_single_colour_takes_the_blob_like_its_last():
    identity = MarkerIdentity(COLORS[:1], 40)
    first = square_blob(0, 100, 100, 20)
    assert associated(identity, [[first]], 0) == [first]
    near, far = square_blob(0, 112, 100, 18), square_blob(0, 400, 300, 40)
    assert associated(identity, [[far, near]], 1) == [near]


def test_a_speck_far_away_is_not_the_marker_that_left_a_moment_ago():
    identity = MarkerIdentity(COLORS[:1], 40)
    for seq in range(4):
        associated(identity, [[square_blob(0, 300 + 40 * seq, 200, 60)]], seq)
    speck = square_blob(0, 60, 60, 8)
    assert associated(identity, [[speck]], 6) == [None]
    # Long after, nobody knows how far away it is.
    assert associated(identity, [[speck]], 400) == [speck]


def test_two_alike_are_ambiguous():
    identity = MarkerIdentity(COLORS[:1], 40)
    associated(identity, [[square_blob(0, 100, 100)]], 0)
    stamp_ns = START_NS + FRAME_NS
    (alone,) = identity.associate([[square_blob(0, 100, 100)]], stamp_ns, nothing_known)
    (doubtful,) = identity.associate(
        [[square_blob(0, 90, 100), square_blob(0, 110, 100)]], stamp_ns, nothing_known
    )
    assert doubtful.certainty < 0.6 < alone.certainty


def test_of_a_room_full_of_colour_only_the_likeliest_are_compared(monkeypatch):
    """Test: a followed hand among 400 specks of each colour.

    Expected: it goes on being followed, at a bounded number of comparisons.
    """
    compared = []
    monkeypatch.setattr(
        group_consistency,
        "_pairs",
        lambda blobs, pairs=group_consistency._pairs: compared.append(len(blobs)) or pairs(blobs),
    )
    identity = MarkerIdentity(COLORS, 40)
    tips = hand_blobs(300, 250)
    for seq in range(3):
        associated(identity, [[tip] for tip in tips], seq)
    assert associated(identity, among_specks(tips, 6, seed=4), 3) == tips
    # Each of 96 with each, where it would be each of 2406 specks.
    assert compared[-1] == 96


def test_at_first_the_largest_of_many_are_compared():
    """Test: nothing is known yet.

    Expected: a hand among 400 specks of each colour that are smaller than it is found.
    """
    tips = hand_blobs(300, 250)
    assert associated(MarkerIdentity(COLORS, 40), among_specks(tips, 4, seed=5), 0) == tips


def test_what_looks_like_the_room_is_not_the_marker_that_hides():
    """A tip is hidden, and a piece of a thing of its colour appears beside the hand."""
    for like_room, found in ((lambda blob: blob.color == 2, None), (nothing_known, "piece")):
        identity = MarkerIdentity(COLORS, 40)
        for seq in range(5):
            associated(identity, [[tip] for tip in hand_blobs(300, 250)], seq)
        piece = square_blob(2, 300, 140, 8)
        blobs = [[tip] if tip.color != 2 else [piece] for tip in hand_blobs(300, 250)]
        taken = associated(identity, blobs, 12, like_room)[2]
        assert taken is (piece if found else None)


def test_a_marker_that_looks_like_the_room_goes_on_being_followed():
    identity = MarkerIdentity(COLORS, 40)
    for seq in range(5):
        associated(identity, [[tip] for tip in hand_blobs(300 + 5 * seq, 250)], seq)
    tips, speck = hand_blobs(325, 250), square_blob(2, 500, 60, 8)
    blobs = [[tip] if tip.color != 2 else [speck, tip] for tip in tips]
    assert associated(identity, blobs, 5, lambda blob: blob.color == 2) == tips


def test_specks_are_no_rivals_of_a_marker_that_lies_still():
    """Noise makes them in every picture of a dim room, whose walls look like the marker."""
    identity = MarkerIdentity(COLORS, 40)
    thumb = square_blob(0, 240, 230)
    for seq in range(12):
        blobs = [[tip] for tip in hand_blobs(300, 250)]
        blobs[0] = [thumb, square_blob(0, 400 + 60 * (seq % 2), 300, 4)]
        assert associated(identity, blobs, seq, lambda blob: blob is thumb)[0] is thumb
