"""The filter of all dots: against an estimate of all at once, and what neighbours say of a dot."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.chains import chains_of, finger_landmarks

CHAINS = chains_of(finger_landmarks("index"))
PLACES = np.array([[0.0, 0.0], [60.0, 0.0], [95.0, 0.0], [120.0, 0.0]])


def _predicted() -> motion.State:
    state = motion.start(PLACES, np.full(4, 1.0), 300.0)
    return motion.predict(state, 1 / 30, 3000.0**2 * CHAINS.acceleration)


def test_what_the_others_say_of_a_dot_is_the_estimate_without_it() -> None:
    state = _predicted()
    measured = PLACES + np.array([12.0, 3.0])
    dots, variances = np.arange(4), np.full(4, 1.0)
    places, spreads = motion.expected(
        state, motion.innovate(state, dots, measured, variances), variances
    )
    for dot in range(4):
        others = np.delete(dots, dot)
        without = motion.update(
            state, motion.innovate(state, others, measured[others], variances[others])
        )
        assert np.allclose(places[dot], without.positions[dot])
        assert np.isclose(spreads[dot], without.cov[dot, dot] + 1.0)


def test_a_hidden_dot_goes_along_with_its_hand() -> None:
    state = _predicted()
    seen = np.array([0, 1, 3])
    moved = PLACES + np.array([40.0, -25.0])
    found = motion.update(state, motion.innovate(state, seen, moved[seen], np.full(3, 1.0)))
    assert np.linalg.norm(found.positions[2] - moved[2]) < 5.0
    assert found.cov[2, 2] > found.cov[1, 1]


def test_the_spread_of_a_bone_stays_below_its_length() -> None:
    state = motion.start(PLACES, np.full(4, 1.0), 0.0)
    lengths = np.array([70.0, 45.0, 35.0])
    for _ in range(200):
        state = motion.predict(state, 1 / 30, 9000.0**2 * CHAINS.acceleration)
        state = motion.update(
            state, motion.innovate(state, np.array([0]), state.positions[:1], np.ones(1))
        )
        state = motion.bound_bones(state, CHAINS.bones, lengths)
        for (near, far), length in zip(CHAINS.bones, lengths, strict=True):
            spread = state.cov[near, near] + state.cov[far, far] - 2.0 * state.cov[near, far]
            assert -1e-6 < spread <= 0.5 * length**2 + 1e-6
