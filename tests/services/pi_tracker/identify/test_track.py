"""The track of one marker."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.identify.track import Track
from testing.synthetic_blobs import square_blob

FRAME_NS = 33_333_333


@pytest.mark.parametrize("stamps", [[0, 0, 0], [5, 3, 1], [0, 2**62, 3]])
def test_stamps_that_stand_still_or_run_backwards_are_survived(stamps):
    track = Track(10.0, 10.0, 100.0, 100.0, 0)
    for stamp_ns in stamps:
        likeness = track.likeness(square_blob(0, 12, 10, 10), stamp_ns, 40)
        assert 0.0 <= likeness <= 1.0
        track.update(12.0, 10.0, 100.0, 100.0, stamp_ns)
        assert np.isfinite([track.vx_px_s, track.vy_px_s]).all()


def test_velocity_predicts_for_a_tenth_of_a_second_and_no_longer():
    track = Track(10.0, 20.0, 100.0, 100.0, 0)
    track.update(13.0, 18.0, 100.0, 100.0, FRAME_NS)
    assert track.predicted(2 * FRAME_NS) == pytest.approx((16.0, 16.0), abs=1e-6)
    assert track.predicted(FRAME_NS + 10**8) == track.predicted(FRAME_NS + 10**10)


def test_blobs_are_compared_as_they_are_found_and_not_as_they_grow():
    small, large = square_blob(0, 10, 10, 10), square_blob(0, 10, 10, 20)
    track = Track(small.x_px, small.y_px, large.area_px, small.area_px, 0)
    assert track.likeness(small, FRAME_NS, 40) == pytest.approx(1.0)
    assert track.likeness(large, FRAME_NS, 40) < 0.6
    for frame in range(1, 30):
        track.update(10.0, 10.0, large.area_px, large.area_px, frame * FRAME_NS)
    assert track.found_px2 == pytest.approx(large.area_px, rel=0.01)


def test_what_a_marker_is_as_a_whole_is_learned_soon_and_forgotten_slowly():
    track = Track(10.0, 10.0, 100.0, 100.0, 0)
    for frame in range(1, 15):
        track.update(10.0, 10.0, 200.0, 180.0, frame * FRAME_NS)
    assert track.whole_px2 == pytest.approx(200.0, rel=0.05)
    for frame in range(15, 30):
        track.update(10.0, 10.0, 50.0, 40.0, frame * FRAME_NS)
    assert track.area_px < 60.0
    assert track.whole_px2 > 150.0


def test_a_marker_is_no_larger_as_a_whole_than_what_is_found_of_it_lets_it_be():
    track = Track(10.0, 10.0, 100.0, 100.0, 0)
    for frame in range(1, 200):
        track.update(10.0, 10.0, 1.5 * track.whole_px2, 100.0, frame * FRAME_NS)
    assert track.whole_px2 <= 250.0


def test_a_coasting_track_moves_but_was_not_seen():
    track = Track(10.0, 20.0, 100.0, 100.0, 0)
    track.coast((5.0, -2.0), (0.0, 0.0), FRAME_NS)
    assert (track.x_px, track.y_px, track.seen_ns) == (15.0, 18.0, 0)
    assert track.is_recent(FRAME_NS)
    assert not track.is_recent(10**9)


@pytest.mark.parametrize(
    ("own_px", "others_px", "share"),
    [(20.0, 20.0, 1.0), (10.0, 20.0, 0.5), (0.1, 40.0, 0.0), (-20.0, 20.0, 0.0), (0.1, 0.1, 1.0)],
)
def test_a_lost_marker_goes_on_with_as_much_of_the_others_motion_as_it_had(
    own_px, others_px, share
):
    """A frame's motions; those of a wrist about which a hand turns are none."""
    track = Track(10.0, 20.0, 100.0, 100.0, 0)
    track.update(10.0 + own_px, 20.0, 100.0, 100.0, FRAME_NS)
    at_px = track.x_px
    # The others turn back meanwhile.
    for frame, moved_px in enumerate((30.0, -10.0), start=2):
        track.coast((moved_px, 0.0), (others_px * 1e9 / FRAME_NS, 0.0), frame * FRAME_NS)
        at_px += share * moved_px
        assert track.x_px == pytest.approx(at_px, abs=1.0)
