"""Which blob is the marker."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.detect.blob_search import Blob
from services.pi_tracker.identify import group_consistency
from services.pi_tracker.identify.group_consistency import Candidate, best_set, support
from services.pi_tracker.identify.marker_identity import Identity, Track, shape_fits

FRAME_NS = 33_333_333
START_NS = 1_700_000_000_000_000_000


def filled(color, rect, mask=None):
    """A blob of a rectangle, full but for a mask."""
    x0, y0, x1, y1 = rect
    mask = np.ones((y1 - y0, x1 - x0), np.uint8) if mask is None else mask
    cells = int(np.count_nonzero(mask))
    return Blob(color, rect, mask, cells, 4.0 * cells, x0 + x1 - 0.5, y0 + y1 - 0.5)


def blob(color, x_px, y_px, side_px=14):
    """A square blob about a pixel."""
    cells = max(side_px // 2, 1)
    x0, y0 = round(x_px / 2 - cells / 2), round(y_px / 2 - cells / 2)
    return filled(color, (x0, y0, x0 + cells, y0 + cells))


def hand(x_px, y_px, side_px=14):
    """One blob per colour: five tips in an arc and a wrist."""
    places = [(-60, -20), (-30, -60), (0, -70), (30, -60), (55, -40), (0, 60)]
    return [blob(color, x_px + dx, y_px + dy, side_px) for color, (dx, dy) in enumerate(places)]


def chosen(identity, blobs, seq):
    """Choose, and follow what was chosen."""
    stamp_ns = START_NS + seq * FRAME_NS
    choices = identity.choose(blobs, stamp_ns)
    for color, choice in enumerate(choices):
        if choice is not None:
            identity.follow(
                color, choice.blob.x_px, choice.blob.y_px, choice.blob.area_px, stamp_ns
            )
    return [None if choice is None else choice.blob for choice in choices]


def test_a_hand_is_preferred_to_larger_things_in_the_room():
    tips = hand(400, 250)
    things = [blob(0, 60, 60, 40), blob(1, 600, 60, 36), blob(2, 60, 420, 34), blob(5, 80, 240, 44)]
    blobs = [[one for one in things + tips if one.color == color] for color in range(6)]
    assert chosen(Identity(6, 40), blobs, 0) == tips


def test_a_hand_is_told_from_things_that_keep_company_too():
    tips = hand(430, 250)
    things = [blob(color, 80 + 15 * color, 100 + 60 * (color % 3), 36) for color in range(4)]
    blobs = [[one for one in things + tips if one.color == color] for color in range(6)]
    assert chosen(Identity(6, 40), blobs, 0) == tips


def test_a_marker_half_hidden_by_another_is_known_by_its_place():
    """A few cells beside a larger blob are that one's rim as a rule, but not where the marker
    itself must be.
    """
    identity = Identity(6, 40)
    for seq in range(5):
        tips = hand(300 + 9 * seq, 250)
        chosen(identity, [[tip] for tip in tips], seq)
    tips = hand(345, 250)
    x1, y0 = tips[2].rect[2], tips[2].rect[1]
    sliver = filled(1, (x1, y0, x1 + 2, y0 + 4))
    rim = filled(5, (x1, y0 + 4, x1 + 2, y0 + 7))
    blobs = [[tip] for tip in tips]
    blobs[5].append(rim)
    blobs[1] = [sliver]
    blobs[2] = [tips[2]]
    found = chosen(identity, blobs, 5)
    assert found[5] == tips[5]
    # Forty pixels from where it was.
    assert found[1] is None
    near = filled(1, (*tips[1].rect[:2], tips[1].rect[0] + 2, tips[1].rect[1] + 4))
    blobs[1] = [near]
    blobs[2] = [blob(2, near.rect[2] * 2 + 7, near.rect[1] * 2 + 7)]
    assert chosen(identity, blobs, 5)[1] == near


def test_a_hidden_marker_moves_with_the_hand():
    identity = Identity(6, 40)
    for seq in range(3):
        chosen(identity, [[tip] for tip in hand(200 + 20 * seq, 250)], seq)
    for seq in range(3, 8):
        tips = hand(200 + 20 * seq, 250)
        chosen(identity, [[tip] if color != 3 else [] for color, tip in enumerate(tips)], seq)
    tips = hand(200 + 20 * 8, 250)
    sliver = filled(3, (*tips[3].rect[:2], tips[3].rect[0] + 2, tips[3].rect[1] + 4))
    beside = blob(2, sliver.rect[0] * 2 - 7, sliver.rect[1] * 2 + 4)
    blobs = [[tip] for tip in tips]
    blobs[3], blobs[2] = [sliver], [beside]
    assert chosen(identity, blobs, 8)[3] == sliver


def test_what_is_hidden_of_a_marker_is_told():
    identity = Identity(2, 40)
    left, right = blob(0, 100, 100), blob(1, 160, 100)
    for seq in range(4):
        chosen(identity, [[left], [right]], seq)
    near = blob(1, 112, 100)
    stamp_ns = START_NS + 4 * FRAME_NS
    assert None not in identity.choose([[left], [near]], stamp_ns)
    whole_px2 = left.area_px
    assert identity.follow(0, left.x_px, left.y_px, 0.5 * whole_px2, stamp_ns) == pytest.approx(0.5)
    # Nothing touches it: it turns away.
    for share, hidden in ((0.9, 0.0), (0.8, 0.0), (0.7, 0.0), (0.4, 0.5)):
        stamp_ns += FRAME_NS
        assert None not in identity.choose([[left], [right]], stamp_ns)
        assert identity.follow(
            0, left.x_px, left.y_px, share * whole_px2, stamp_ns
        ) == pytest.approx(hidden, abs=0.1)


def test_a_lost_marker_is_found_again_in_the_next_frame_that_shows_it():
    identity = Identity(6, 40)
    for seq in range(5):
        chosen(identity, [[tip] for tip in hand(300, 250)], seq)
    for seq in range(5, 40):
        chosen(identity, [[] for _ in range(6)], seq)
    tips = hand(150, 150)
    assert chosen(identity, [[tip] for tip in tips], 40) == tips


def test_a_wrong_start_is_mended():
    identity = Identity(6, 40)
    thing = blob(5, 80, 240, 40)
    tips = hand(400, 250)
    chosen(identity, [[], [], [], [], [], [thing]], 0)
    found = chosen(
        identity, [[tip] if color != 5 else [thing, tip] for color, tip in enumerate(tips)], 1
    )
    assert found == tips


def test_a_single_colour_takes_the_blob_like_its_last():
    identity = Identity(1, 40)
    first = blob(0, 100, 100, 20)
    assert chosen(identity, [[first]], 0) == [first]
    near, far = blob(0, 112, 100, 18), blob(0, 400, 300, 40)
    assert chosen(identity, [[far, near]], 1) == [near]


def test_a_speck_far_away_is_not_the_marker_that_left_a_moment_ago():
    identity = Identity(1, 40)
    for seq in range(4):
        chosen(identity, [[blob(0, 300 + 40 * seq, 200, 60)]], seq)
    speck = blob(0, 60, 60, 8)
    assert chosen(identity, [[speck]], 6) == [None]
    # Long after, nobody knows how far away it is.
    assert chosen(identity, [[speck]], 400) == [speck]


def test_two_alike_are_ambiguous():
    identity = Identity(1, 40)
    chosen(identity, [[blob(0, 100, 100)]], 0)
    (alone,) = identity.choose([[blob(0, 100, 100)]], START_NS + FRAME_NS)
    (doubtful,) = identity.choose([[blob(0, 90, 100), blob(0, 110, 100)]], START_NS + FRAME_NS)
    assert doubtful.certainty < 0.6 < alone.certainty


@pytest.mark.parametrize("stamps", [[0, 0, 0], [5, 3, 1], [0, 2**62, 3]])
def test_stamps_that_stand_still_or_run_backwards_are_survived(stamps):
    track = Track(10.0, 10.0, 100.0, 0)
    for stamp_ns in stamps:
        likeness = track.likeness(blob(0, 12, 10, 10), stamp_ns, 40)
        assert 0.0 <= likeness <= 1.0
        track.follow(12.0, 10.0, 100.0, stamp_ns)
        assert np.isfinite([track.vx_px_s, track.vy_px_s]).all()


def test_shapes_that_no_patch_of_paint_has():
    assert shape_fits(blob(0, 50, 50), 20_000.0)
    assert not shape_fits(blob(0, 50, 50, 200), 20_000.0)
    stripe = filled(0, (0, 0, 40, 2))
    cross = filled(0, (0, 0, 40, 40), np.eye(40, dtype=np.uint8))
    assert not shape_fits(stripe, 20_000.0)
    assert not shape_fits(cross, 20_000.0)


def test_company_is_near_and_of_one_size():
    others = hand(300, 250)[:5]
    assert support(blob(5, 300, 310), others) > 0.6
    assert support(blob(5, 620, 20), others) < 0.15
    assert support(blob(5, 300, 310, 100), others) < 0.2
    assert support(blob(5, 300, 310), []) == 1.0


def test_the_best_set_of_nothing_is_nothing():
    assert best_set([]) == []
    assert best_set([[], []]) == [None, None]
    only = Candidate(blob(1, 50, 50), 0.5)
    assert best_set([[], [only]]) == [None, (only, 1.0)]


def test_of_a_room_full_of_colour_only_the_likeliest_are_compared(monkeypatch):
    """Test: a followed hand among 400 specks of each colour.

    Expected: it goes on being followed, at a bounded number of comparisons.
    """
    compared = []
    monkeypatch.setattr(
        group_consistency,
        "_fit",
        lambda a, b, fit=group_consistency._fit: compared.append(a) or fit(a, b),
    )
    identity, random = Identity(6, 40), np.random.default_rng(4)
    tips = hand(300, 250)
    for seq in range(3):
        chosen(identity, [[tip] for tip in tips], seq)
    specks = [
        [blob(color, x, y, 6) for x, y in random.uniform(20, 460, (400, 2)).tolist()]
        for color in range(6)
    ]
    assert chosen(identity, [[*own, tip] for own, tip in zip(specks, tips, strict=True)], 3) == tips
    # 96 candidates gather 80 others each, and 15 pairs of what they gathered are summed; of all
    # specks it would be 6 million.
    assert 0 < len(compared) < 10_000


def test_at_first_the_largest_of_many_are_compared():
    """Test: nothing is known yet.

    Expected: a hand among 400 specks of each colour that are smaller than it is found.
    """
    random = np.random.default_rng(5)
    specks = [
        [blob(color, x, y, 4) for x, y in random.uniform(20, 460, (400, 2)).tolist()]
        for color in range(6)
    ]
    tips = hand(300, 250)
    assert (
        chosen(Identity(6, 40), [[*own, tip] for own, tip in zip(specks, tips, strict=True)], 0)
        == tips
    )
