"""Which way a landmark came: a direction when it moves, none at rest; and what it is worth."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.kalman.motion_model import Gaussian, discretize, empty_step
from services.fusion.kalman.recent_way import (
    MEMORY_S,
    SLOW_M_S,
    add_noise_along,
    unknown_way,
    update_way,
)


def after(way, velocity, seconds, steps):
    state = np.array([0.5, 0.6, 0.7, *velocity, 20.0, -30.0, 40.0])
    for _ in range(steps):
        later = np.empty((3, 3))
        update_way(way, state, seconds / steps, later)
        way = later
    return way


def nothing_known():
    way = np.empty((3, 3))
    unknown_way(way)
    return way


def test_a_way_is_where_a_landmark_moves_and_is_forgotten():
    along = after(nothing_known(), (0.0, 0.6, 0.8), 10 * MEMORY_S, 50)
    values, vectors = np.linalg.eigh(along)
    np.testing.assert_allclose(np.abs(vectors[:, 2]), [0.0, 0.6, 0.8], atol=1e-6)
    assert values[2] == pytest.approx(1.0, rel=0.01)
    # To and fro is one way.
    np.testing.assert_allclose(after(along, (0.0, -0.6, -0.8), MEMORY_S, 4), along, atol=1e-3)
    at_rest = after(along, (0.0, 0.0, 0.0), 20 * MEMORY_S, 50)
    np.testing.assert_allclose(at_rest, nothing_known(), atol=1e-8)
    assert np.trace(at_rest) == pytest.approx(SLOW_M_S**2)


def test_short_steps_make_one_long_one():
    once = after(nothing_known(), (0.3, 0.1, -0.2), 0.05, 1)
    np.testing.assert_allclose(after(nothing_known(), (0.3, 0.1, -0.2), 0.05, 7), once)


def test_noise_is_added_along_the_way_alone():
    step = empty_step()
    discretize(0.02, np.array([100.0, 8.0, 20.0, 500.0]), step)
    predicted = Gaussian(np.zeros(9), np.zeros((9, 9)))
    direction = np.array([0.0, 0.6, 0.8])
    add_noise_along(4.0 * np.outer(direction, direction), step, 5.0, predicted)
    expected = np.kron(step.Q, 5.0 * np.outer(direction, direction))
    np.testing.assert_allclose(predicted.cov, expected, atol=1e-18)


def stroked(one_track, rows):
    """Depth errors (n,) without lag of a landmark that goes to and fro sideways, by some models."""
    track, random = one_track(densities=(1.0,) * len(rows)), np.random.default_rng(5)
    track.models = np.array(rows)
    errors = []
    for k in range(150):
        time_s = k / 60.0
        # .8 m/s either way, turned within a tenth of a second.
        way = 0.08 * np.arcsin(0.95 * np.sin(4.0 * np.pi * time_s)) / np.arcsin(0.95)
        place = track.START_M + np.array([way, 0.3 * way, 0.0])
        track.add(time_s, k % 2, track.seen(k % 2, place, random), gate=30.0)
        if k > 60:
            errors.append(track.at(time_s)[0][2] - place[2])
    return np.array(errors)


def test_a_model_that_knows_the_way_takes_no_turn_for_depth(one_track):
    calm, lively = (100.0, 8.0, 20.0, 0.0), (2e5, 8.0, 20.0, 0.0)
    along = (100.0, 8.0, 20.0, 2e5)
    without = stroked(one_track, (calm, lively))
    with_it = stroked(one_track, (calm, along, lively))
    assert np.sqrt(np.mean(with_it**2)) < 0.6 * np.sqrt(np.mean(without**2))
