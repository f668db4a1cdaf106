"""What a hand's shape of a frame ago says of where its landmarks are."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.one_camera.kept_shape import (
    FIRST_M,
    empty_memory,
    hold_shape,
    learn_deformation,
)

SHAPE = np.random.default_rng(5).normal(0.0, 0.05, (6, 3)) + np.array([0.0, 0.0, 0.5])
SPAN_S = 1.0 / 30.0
EYE = np.zeros(3)


def needles(places, along_m=0.04, across_m=2e-4):
    """Covariances (n, 3, 3) of places that one camera at the origin sees well."""
    rays = places / np.linalg.norm(places, axis=1, keepdims=True)
    along = rays[:, :, None] * rays[:, None, :]
    return along_m**2 * along + across_m**2 * (np.eye(3) - along)


def sure(places, sigma_m=5e-4):
    return np.tile(np.eye(3) * sigma_m**2, (len(places), 1, 1))


def test_all_landmarks_off_together_in_depth_are_put_right():
    truth = SHAPE + np.array([0.02, 0.01, 0.015])
    places, covs = truth * 1.05, needles(truth)
    hold_shape(np.full(6, 1e-8), SHAPE, sure(SHAPE, 3e-4), places, covs)
    errors = places - truth
    assert np.linalg.norm(errors, axis=1).max() < 0.004
    normalised = [e @ np.linalg.solve(c, e) / 3.0 for e, c in zip(errors, covs, strict=True)]
    assert np.mean(normalised) < 3.0
    assert np.sqrt(covs[:, 2, 2].max()) < 0.01
    for cov in covs:
        np.testing.assert_array_equal(cov, cov.T)
        assert np.linalg.eigvalsh(cov).min() > 0.0


def test_a_landmark_that_moves_on_its_own_is_left_alone():
    truth = SHAPE.copy()
    truth[2] += [0.03, 0.0, 0.0]
    places, covs = truth.copy(), sure(truth, 1e-3)
    deformed = np.full(6, 1e-8)
    deformed[2] = 0.03**2
    hold_shape(deformed, SHAPE, sure(SHAPE), places, covs)
    assert np.linalg.norm(places - truth, axis=1).max() < 5e-4


def test_a_shape_that_is_contradicted_counts_for_less():
    """All fingers set off at once, which nothing had told: the estimates are believed."""
    truth = SHAPE + np.random.default_rng(6).normal(0.0, 0.02, (6, 3))
    places = truth.copy()
    hold_shape(np.full(6, 1e-8), SHAPE, sure(SHAPE), places, sure(truth, 1e-3))
    assert np.linalg.norm(places - truth, axis=1).max() < 0.002


def test_what_a_landmark_does_on_its_own_is_learnt_and_forgotten():
    memory, hand, known = empty_memory(6, EYE), np.zeros(6, dtype=np.int64), np.ones(6, np.bool_)
    assert memory.deformed == pytest.approx(np.full(6, FIRST_M**2))
    places, time_s = SHAPE.copy(), 0.0
    for _ in range(30):  # the hand moves as one
        places = places + np.array([0.01, 0.0, 0.005])
        time_s += SPAN_S
        learn_deformation(memory, hand, known, places, time_s, SPAN_S)
    assert np.sqrt(memory.deformed.max()) < 2e-4
    bent = places.copy()
    bent[4] += [0.0, 0.03, 0.0]
    learn_deformation(memory, hand, known, bent, time_s + SPAN_S, SPAN_S)
    assert memory.deformed.argmax() == 4
    assert np.sqrt(memory.deformed[4]) > 0.008
    # After a gap nothing follows from two shapes.
    before = memory.deformed.copy()
    learn_deformation(memory, hand, known, places, time_s + 10 * SPAN_S, SPAN_S)
    np.testing.assert_array_equal(memory.deformed, before)


def test_depth_that_is_unsure_is_not_taken_for_motion_of_fingers():
    memory, hand, known = empty_memory(6, EYE), np.zeros(6, dtype=np.int64), np.ones(6, np.bool_)
    rng = np.random.default_rng(7)
    for n in range(30):
        places = SHAPE * (1.0 + rng.normal(0.0, 0.004, (6, 1)))  # 2 mm along the view
        learn_deformation(memory, hand, known, places, n * SPAN_S, SPAN_S)
    assert np.sqrt(memory.deformed.max()) < 1e-3
