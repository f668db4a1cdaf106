"""A hand that moves as one body keeps its velocities; what bends a finger is taken away."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.motion.rigid_motion import body_transform


def test_velocities_of_a_body_stay_what_they_are():
    random = np.random.default_rng(3)
    places = random.normal(0.0, 0.05, (6, 3))
    arms = places - places[:5].mean(axis=0)
    velocity = np.array([0.2, -0.1, 0.3]) + np.cross([1.0, -2.0, 0.5], arms)
    alive = np.array([True] * 5 + [False])
    velocity[5] = 0.0
    x = np.concatenate([places.ravel(), velocity.ravel(), np.zeros(19)])
    T = body_transform(x, alive)
    np.testing.assert_allclose(T @ x, x, atol=1e-12)
    # What bends a finger is taken away.
    bent = x.copy()
    bent[18:21] += [0.05, 0.0, 0.0]
    assert np.abs((T @ bent - x)[18:36]).max() < 0.05
    np.testing.assert_allclose(T @ T, T, atol=1e-12)
