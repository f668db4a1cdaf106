"""A proposal for the 1-Euro filter from a synthetic recording: still, then fast."""

from __future__ import annotations

import pytest

from rhot.errors import CaptureError
from services.fusion.paired.one_euro_tuning import propose
from services.fusion.paired.recorded_tracks import tracks

NOISE_M = 1e-3


def test_finds_still_and_fast_and_the_noise(recording):
    found = propose(tracks(recording(5.0, 6.0)))
    assert found.still_s == pytest.approx(5.0, abs=0.6)
    assert found.moving_s == pytest.approx(6.0, abs=1.1)
    assert found.noise_mm == pytest.approx(1e3 * NOISE_M, rel=0.1)
    assert found.speed_m_s == pytest.approx(0.5, rel=0.25)
    assert found.best.jitter_share <= 0.525
    # rig.toml's defaults were chosen for this very case: 1.2 Hz and 170 among 1 mm of noise.
    assert 0.3 < found.best.mincutoff_hz < 4.0
    assert 40.0 < found.best.beta < 600.0


def test_calm_costs_lag_and_error(recording):
    rows = propose(tracks(recording(4.0, 5.0, noise_m=3e-3))).rows
    assert len(rows) >= 4
    for calm, lively in zip(rows[1:], rows, strict=False):
        assert calm.jitter_mm < lively.jitter_mm
        assert calm.error_mm >= lively.error_mm - 1e-3


def test_more_noise_asks_for_a_lower_beta(recording):
    quiet, loud = (
        propose(tracks(recording(4.0, 5.0, noise_m=noise_m))).best.beta for noise_m in (5e-4, 4e-3)
    )
    assert loud < quiet


@pytest.mark.parametrize(("still_s", "fast_s"), [(0.0, 8.0), (8.0, 0.0), (0.5, 0.2), (0.0, 0.0)])
def test_says_what_to_record(recording, still_s, fast_s):
    with pytest.raises(CaptureError, match="hold the hand still"):
        propose(tracks(recording(still_s, fast_s)))


def test_predicted_points_do_not_count(recording):
    with pytest.raises(CaptureError, match=r"0\.0 s of a still"):
        propose(tracks(recording(5.0, 5.0, source="predicted")))


def test_calm_beyond_reach_is_an_error(recording):
    with pytest.raises(CaptureError, match="--jitter"):
        propose(tracks(recording(4.0, 4.0)), 0.01)
