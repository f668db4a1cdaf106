"""The shift between two clocks, from heights: found, robust, and as sure as it says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from services.fusion.monitors.shift_regression import NOTHING, Heights, fit_shift

FOCAL_PX = 527.0
SIGMA, CONSTANT = 0.15 / FOCAL_PX, 1.0 / FOCAL_PX


def heights(
    shift_s: float,
    instants: int = 60,
    *,
    noise_px: float = 0.15,
    lasting: float = 0.0,
    shared: float = 0.0,
    speed: float = 0.4,
    seed: int = 1,
) -> Heights:
    """Six swinging landmarks; errors of noise_px that last and are shared as told."""
    random = np.random.default_rng(seed)
    mixed = np.linalg.cholesky((1.0 - shared) * np.eye(6) + shared)
    errors = np.zeros((instants, 6))
    for k in range(instants):
        fresh = mixed @ random.normal(0.0, noise_px / FOCAL_PX, 6)
        before = errors[k - 1] if k else fresh
        errors[k] = lasting * before + np.sqrt(1.0 - lasting**2) * fresh
    speeds = speed * np.sin(0.6 * np.arange(instants)[:, None] + random.uniform(0.0, 1.5, 6))
    own = random.normal(0.0, 0.3 / FOCAL_PX, 6)
    n = 6 * instants
    return Heights(
        np.repeat(np.arange(instants), 6),
        np.tile(np.arange(6), instants),
        (shift_s * speeds + own + errors).ravel(),
        np.zeros(n),
        speeds.ravel(),
        np.full(n, 1.0 / 15.0),
        np.full(n, SIGMA**2),
        np.ones(n),
    )


def test_a_shift_is_found_beside_heights_that_are_off():
    rows = heights(0.003)
    found = fit_shift(rows, 0.0, CONSTANT)
    assert found.shift_s == pytest.approx(0.003, abs=2e-4)
    assert found.scale == pytest.approx(1.0, abs=0.2)
    lifted = rows._replace(heights=rows.heights + 1.5 / FOCAL_PX)
    assert fit_shift(lifted, 0.0, CONSTANT).height - found.height == pytest.approx(
        1.5 / FOCAL_PX, rel=0.05
    )


@pytest.mark.parametrize(("lasting", "shared"), [(0.0, 0.0), (0.34, 0.0), (0.34, 0.6)])
def test_it_claims_no_more_than_it_knows(lasting, shared):
    off = []
    for seed in range(60):
        rows = heights(0.0, noise_px=2.0, lasting=lasting, shared=shared, seed=seed)
        found = fit_shift(rows, 0.0, CONSTANT)
        off.append(found.shift_s / np.sqrt(found.variance))
    assert np.mean(np.square(off)) < 1.2


def test_wrong_rows_lose_their_weight():
    rows = heights(0.003)
    wrong = rows.heights.copy()
    wrong[rows.landmarks == 2] += 0.05
    wrong[rows.instants < 10] = 0.04
    assert fit_shift(rows._replace(heights=wrong), 0.0, CONSTANT).shift_s == pytest.approx(
        0.003, abs=4e-4
    )


def test_nothing_is_found_where_nothing_tells():
    assert fit_shift(heights(0.0, 2), 0.0, CONSTANT) == NOTHING
    still = fit_shift(heights(0.0, speed=0.0), 0.0, CONSTANT)
    assert math.isinf(still.variance)
    # Motion within the noise is none.
    slow = fit_shift(heights(0.01, noise_px=3.0, speed=0.05), 0.0, CONSTANT)
    assert math.isinf(slow.variance)
