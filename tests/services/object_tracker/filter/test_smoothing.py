"""Smoothing: rest becomes still, nothing lags by more than the leash, at every rate alike."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rhot.geometry.quaternions import conjugate, from_vector, multiply, to_vector
from services.object_tracker.filter.smoothing import Smoother

LEASH_M = 1e-3


def angle(p, q) -> float:
    return math.hypot(*to_vector(multiply(p, conjugate(q))))


@pytest.mark.parametrize("rate_hz", [60, 250, 1000])
def test_rest_becomes_still(rate_hz: int) -> None:
    rng = np.random.default_rng(0)
    smoother = Smoother(LEASH_M)
    before, after, turned = [], [], []
    for k in range(10 * rate_hz):
        p = rng.normal(0.0, 2e-4, 3)
        q = from_vector(*rng.normal(0.0, 5e-4, 3).tolist())
        position, orientation = smoother.take(round(k / rate_hz * 1e9), tuple(p.tolist()), q)
        if k > 2 * rate_hz:
            before.append(p)
            after.append(position)
            turned.append(to_vector(orientation))
    # A first-order low pass at f keeps sqrt(pi f / rate) of white noise.
    expected = math.sqrt(math.pi * 0.5 / rate_hz)
    assert np.std(after) / np.std(before) < 1.5 * expected
    assert np.std(turned) / 5e-4 < 1.5 * expected


@pytest.mark.parametrize("rate_hz", [60, 250, 1000])
@pytest.mark.parametrize("speed", [0.01, 0.3, 3.0])
def test_nothing_lags_by_more_than_the_leash(rate_hz: int, speed: float) -> None:
    smoother = Smoother(LEASH_M)
    worst_m = worst_rad = 0.0
    for k in range(2 * rate_hz):
        t = k / rate_hz
        p, q = (speed * t, 0.2, 0.3), from_vector(0.0, 5.0 * speed * t, 0.0)
        position, orientation = smoother.take(round(t * 1e9), p, q)
        worst_m = max(worst_m, math.dist(p, position))
        worst_rad = max(worst_rad, angle(q, orientation))
    assert worst_m <= LEASH_M * 1.000001
    assert worst_rad <= 3.5 * LEASH_M * 1.000001


def test_a_jump_is_taken_at_once() -> None:
    smoother = Smoother(LEASH_M)
    smoother.take(0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    position, _ = smoother.take(1, (5.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
    assert position[0] == pytest.approx(5.0 - LEASH_M)
