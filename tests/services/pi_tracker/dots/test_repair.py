"""An exchange of two names that the shape shows is put right; a shape as it should be is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.chains import chains_of, finger_landmarks
from services.pi_tracker.dots.hypothesis import Hypothesis
from services.pi_tracker.dots.repair import repaired

CHAINS = chains_of((*finger_landmarks("thumb"), *finger_landmarks("index")))
THUMB = np.array([[400.0, 500.0], [490.0, 470.0], [550.0, 440.0], [600.0, 415.0]])
INDEX = np.array([[480.0, 300.0], [590.0, 260.0], [650.0, 250.0], [700.0, 245.0]])
PLACES = np.concatenate([THUMB, INDEX])


def _account() -> Hypothesis:
    near, far = CHAINS.spans.T
    return Hypothesis(
        score=0.0,
        state=motion.start(PLACES, np.ones(8), 100.0),
        lengths=1.05 * np.linalg.norm(PLACES[far] - PLACES[near], axis=1),
        areas=np.full(8, 300.0),
        unseen=np.zeros(8, np.int64),
        patch=tuple(range(8)),
        before=tuple(range(8)),
        false=np.empty((0, 2)),
    )


def test_a_shape_as_it_should_be_is_left() -> None:
    assert repaired(_account(), CHAINS) == []


def test_two_exchanged_dots_change_back() -> None:
    right = _account()
    order = np.array([0, 6, 2, 3, 4, 5, 1, 7])
    rows = np.concatenate([order, 8 + order])
    wrong = replace(
        right,
        state=motion.State(right.state.mean[rows], right.state.cov[np.ix_(rows, rows)]),
        patch=tuple(order.tolist()),
    )
    best = repaired(wrong, CHAINS)[0]
    assert best.patch == right.patch
    assert np.allclose(best.state.mean, right.state.mean)
    assert best.score < wrong.score
