"""How likely a blob is a marker, by its track and by what is beside it."""

from __future__ import annotations

import pytest

from services.pi_tracker.identify.blob_prior import ACCEPT_LIKENESS, blob_priors
from services.pi_tracker.identify.track import Track
from testing.synthetic_blobs import filled_blob, square_blob

NOW_NS = 1_700_000_000_000_000_000
MARGIN_PX = 40


def track_at(blob, still_frames=0):
    """A track that has just seen a blob."""
    area_px2 = blob.area_px
    track = Track(blob.x_px, blob.y_px, area_px2, area_px2, NOW_NS)
    track.stationary_frames = still_frames
    return track


def test_without_a_track_only_a_thin_blob_beside_anothers_is_doubted():
    thing, tip = filled_blob(1, (50, 50, 80, 80)), filled_blob(0, (80, 60, 86, 66))
    edge, alone = filled_blob(0, (80, 50, 82, 60)), filled_blob(0, (100, 50, 102, 60))
    tip_prior, edge_prior, alone_prior = blob_priors(
        0, [[tip, edge, alone], [thing]], None, NOW_NS, MARGIN_PX, 0.0
    )
    assert (tip_prior, alone_prior) == (1.0, 1.0)
    assert edge_prior < 0.5


@pytest.mark.parametrize(("side_px", "doubted"), [(14, True), (8, True), (4, False)])
def test_what_stands_still_is_doubted_beside_what_may_be_the_marker(side_px, doubted):
    """Noise, a few cells of it, may not."""
    tip, other = square_blob(0, 100, 100), square_blob(0, 300, 100, side_px)
    still, moving = (
        blob_priors(0, [[tip, other]], track_at(tip, frames), NOW_NS, MARGIN_PX, 0.0)[0]
        for frames in (8, 0)
    )
    assert moving == pytest.approx(1.0)
    assert (still < ACCEPT_LIKENESS) == doubted


def test_specks_are_not_what_was_much_larger_a_moment_ago():
    tip, speck = square_blob(0, 100, 100, 20), square_blob(0, 300, 100, 4)
    track = track_at(tip)
    assert blob_priors(0, [[speck]], track, NOW_NS, MARGIN_PX, 0.0) == [0.1]
    assert blob_priors(0, [[speck]], track, NOW_NS, MARGIN_PX, tip.area_px) == [0.1]
    long_after_ns = NOW_NS + 6_000_000_000
    assert blob_priors(0, [[speck]], track, long_after_ns, MARGIN_PX, 0.0)[0] > 0.1


def test_what_is_as_large_as_the_other_markers_is_no_speck():
    """What was larger was a poster then."""
    poster, tip = square_blob(0, 100, 100, 40), square_blob(0, 120, 160, 8)
    track = track_at(poster)
    assert blob_priors(0, [[tip]], track, NOW_NS, MARGIN_PX, 2.0 * tip.area_px)[0] > 0.1
