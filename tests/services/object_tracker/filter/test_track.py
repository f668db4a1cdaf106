"""The gate: a hand's fastest motions pass at every rate, outliers do not, and a tracker that was
moved unseen is found again.
"""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.quaternions import from_vector
from services.object_tracker.filter.track import Track, TrackKeeper

RATES = (60, 90, 125, 250, 500, 1000)


def noisy(rng: np.random.Generator, position: np.ndarray, turn: np.ndarray | None = None):
    """(position, orientation) with SteamVR's noise: 1 mm and 0.2 deg."""
    p = position + rng.normal(0.0, 1e-3, 3)
    r = rng.normal(0.0, 3.5e-3, 3) + (0.0 if turn is None else turn)
    return tuple(p.tolist()), from_vector(*r.tolist())


def thrown(t: np.ndarray, g: float) -> np.ndarray:
    """Along x from rest: 60 ms at g, 200 ms of flight, caught within 60 ms; (n, 3)."""
    fine = np.arange(0.0, 1.5, 1e-4)
    a = g * 9.81 * (((fine > 0.5) & (fine < 0.56)) * 1.0 - ((fine > 0.76) & (fine < 0.82)))
    x = np.cumsum(np.cumsum(a)) * 1e-8
    return np.interp(t, fine, x)[:, None] * [1.0, 0.0, 0.0]


@pytest.mark.parametrize("rate_hz", RATES)
def test_a_throw_of_8_g_is_followed_at_every_rate(rate_hz: int) -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        keeper = TrackKeeper()
        t = np.arange(0.0, 1.3, 1.0 / rate_hz) + rng.random() / rate_hz
        turn = np.interp(t, [0.5, 0.8], [0.0, 3.0])
        path = thrown(t, 8.0)
        kept = [
            keeper.take(round(at * 1e9), *noisy(rng, p, np.array([r, 0.0, 0.0]))) is not None
            for at, p, r in zip(t, path, turn, strict=True)
        ]
        assert all(kept)


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_outliers_are_rejected_and_the_others_are_not(rate_hz: int, speed: float) -> None:
    rng = np.random.default_rng(rate_hz)
    keeper = TrackKeeper()
    accepted = rejected = 0
    for k in range(3000):
        t = k / rate_hz
        p = speed * np.array([0.2 * np.sin(5.0 * t), 0.1 * np.sin(8.0 * t), 0.0])
        out = k > 20 and rng.random() < 0.05
        if out:
            d = rng.normal(size=3)
            p = p + rng.uniform(0.12, 0.4) * d / np.linalg.norm(d)
        kept = keeper.take(round(t * 1e9), *noisy(rng, p)) is not None
        accepted += out and kept
        rejected += not out and not kept
    assert accepted == 0
    assert rejected == 0


@pytest.mark.parametrize("rate_hz", RATES)
def test_what_was_moved_unseen_is_found_within_25_ms_or_four_poses(rate_hz: int) -> None:
    rng = np.random.default_rng(1)
    keeper = TrackKeeper()
    for k in range(100):
        keeper.take(round(k / rate_hz * 1e9), *noisy(rng, np.zeros(3)))
    begin_s = 100 / rate_hz + 0.08
    away = np.array([0.4, 0.1, 0.0])
    turn = np.array([0.0, 1.2, 0.0])
    verdicts = [
        keeper.take(round((begin_s + k / rate_hz) * 1e9), *noisy(rng, away, turn)) is not None
        for k in range(100)
    ]
    found = verdicts.index(True)
    assert 3 <= found <= max(3, round(0.025 * rate_hz))
    assert all(verdicts[found:])
    assert keeper.track is not None
    np.testing.assert_allclose(keeper.track.position_m, away, atol=4e-3)


def test_two_poses_that_alternate_never_take_over() -> None:
    """libsurvive's first poses: every second one turned by 180 deg."""
    rng = np.random.default_rng(2)
    keeper = TrackKeeper()
    for k in range(1000):
        turn = np.array([0.0, 3.1 * (k % 2), 0.0])
        kept = keeper.take(k * 8_000_000, *noisy(rng, np.zeros(3), turn)) is not None
        assert kept == (k % 2 == 0)


def test_a_known_velocity_and_its_certainty() -> None:
    rng = np.random.default_rng(3)
    track = Track(0, *noisy(rng, np.zeros(3)))
    errors = []
    for k in range(1, 2000):
        t = k * 0.004
        p = np.array([0.5, -0.2, 0.1]) * t
        turn = np.array([0.0, 0.0, (1.5 * t) % (2.0 * np.pi)])
        assert track.take(k * 4_000_000, *noisy(rng, p, turn))
        if k > 200:
            errors.append(np.array(track.position_m) - p)
    np.testing.assert_allclose(track.velocity_m_s, [0.5, -0.2, 0.1], atol=0.4)
    np.testing.assert_allclose(track.angular_velocity_rad_s, [0.0, 0.0, 1.5], atol=1.5)
    rms = float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))
    # Its own sigma holds stamps that scatter too, which these do not.
    assert rms < track.sigma_m < 4.0 * rms


def test_a_device_that_said_it_was_lost_is_believed_wherever_it_is_next() -> None:
    rng = np.random.default_rng(4)
    keeper = TrackKeeper()
    assert keeper.take(0, *noisy(rng, np.zeros(3)))
    keeper.forget()
    assert keeper.take(4_000_000, *noisy(rng, np.ones(3)))
