"""A proposal for the 1-Euro filter from a synthetic recording: still, then fast."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from rhot.messages import HandPoint, HandPoints
from services.fusion.paired.one_euro import OneEuroFilter
from services.fusion.paired.one_euro_tuning import Track, _one_euro, _smooth, propose, tracks
from testing.synthetic_points import START_NS, Path

NOISE_M = 1e-3


def recording(
    still_s: float,
    fast_s: float,
    speed_m_s: float = 0.5,
    noise_m: float = NOISE_M,
    source="measured",
):
    random, path = np.random.default_rng(0), Path(speed_m_s=speed_m_s)
    for k in range(int(30 * (still_s + fast_s))):
        at_s = max(0.0, k / 30.0 - still_s)
        points = [
            HandPoint(
                name=name,
                position_m=tuple((p + random.normal(0.0, noise_m, 3)).tolist()),
                sigma_m=(1e-3,) * 3,
                cameras=[],
                source=source,
            )
            for name, p in zip(("wrist", "index_tip"), path(np.array([at_s]))[0], strict=False)
        ]
        yield HandPoints(
            hand="right", seq=k, stamp_ns=START_NS + round(k * 1e9 / 30.0), points=points
        )


def test_finds_still_and_fast_and_the_noise():
    found = propose(tracks(recording(5.0, 6.0)))
    assert found.still_s == pytest.approx(5.0, abs=0.6)
    assert found.moving_s == pytest.approx(6.0, abs=1.1)
    assert found.noise_mm == pytest.approx(1e3 * NOISE_M, rel=0.1)
    assert found.speed_m_s == pytest.approx(0.5, rel=0.25)
    assert found.best.jitter_share <= 0.525
    # rig.toml's defaults were chosen for this very case: 1.2 Hz and 170 among 1 mm of noise.
    assert 0.3 < found.best.mincutoff_hz < 4.0
    assert 40.0 < found.best.beta < 600.0


def test_calm_costs_lag_and_error():
    rows = propose(tracks(recording(4.0, 5.0, noise_m=3e-3))).rows
    assert len(rows) >= 4
    for calm, lively in zip(rows[1:], rows, strict=False):
        assert calm.jitter_mm < lively.jitter_mm
        assert calm.error_mm >= lively.error_mm - 1e-3


def test_more_noise_asks_for_a_lower_beta():
    quiet, loud = (
        propose(tracks(recording(4.0, 5.0, noise_m=noise_m))).best.beta for noise_m in (5e-4, 4e-3)
    )
    assert loud < quiet


@pytest.mark.parametrize(("still_s", "fast_s"), [(0.0, 8.0), (8.0, 0.0), (0.5, 0.2), (0.0, 0.0)])
def test_says_what_to_record(still_s, fast_s):
    with pytest.raises(CaptureError, match="hold the hand still"):
        propose(tracks(recording(still_s, fast_s)))


def test_predicted_points_do_not_count():
    with pytest.raises(CaptureError, match=r"0\.0 s of a still"):
        propose(tracks(recording(5.0, 5.0, source="predicted")))


def test_calm_beyond_reach_is_an_error():
    with pytest.raises(CaptureError, match="--jitter"):
        propose(tracks(recording(4.0, 4.0)), 0.01)


def test_is_the_live_filter():
    track = tracks(recording(3.0, 3.0))[0]
    live, steps = (
        OneEuroFilter(1.2, 170.0, 1.0, joint=True),
        [0.0, *np.diff(track.times_s).tolist()],
    )
    expected = np.array([live(point, dt) for point, dt in zip(track.points_m, steps, strict=True)])
    np.testing.assert_allclose(_one_euro(track, 1.2, 170.0), expected, atol=1e-12)


def test_reference_has_no_lag_and_survives_gaps():
    times_s = np.delete(np.arange(0.0, 4.0, 1.0 / 30.0), slice(40, 60))
    points_m = Path()(times_s)[:, 2]
    reference = _smooth(
        Track(times_s, points_m, np.zeros(len(times_s), bool), np.zeros(len(times_s), bool))
    )
    assert 1e3 * np.sqrt(np.mean(np.sum((reference - points_m) ** 2, axis=1))) < 0.3
