"""A cloud of dots that hang on nothing: where a camera sees them, and derivatives."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.dots.body.cloud import Cloud
from services.pi_tracker.dots.body.rotations import turned

SIZE = (640, 480)
PLACES = np.random.default_rng(4).uniform(100.0, 400.0, (8, 2))


def test_a_cloud_begins_where_it_was_seen() -> None:
    cloud = Cloud(PLACES, SIZE)
    state = cloud.begun(np.full(8, 1.0))
    pixels, _ = cloud.project(*state[:4])
    np.testing.assert_allclose(pixels[0], PLACES, atol=1e-6)


def test_derivatives_of_a_cloud_are_finite_differences() -> None:
    cloud, random = Cloud(PLACES, SIZE), np.random.default_rng(5)
    state = cloud.begun(np.full(8, 1.0))
    posture = state.means[:, : cloud.size] + random.normal(0.0, 0.02, cloud.size)
    posture[:, 3:6] = 0.0
    start, sides, facing = turned(random.normal(0.0, 0.4, (1, 3))), state.sides, state.facing
    _, slopes = cloud.project(posture, start, sides, facing)
    for k in range(cloud.size):
        ends = []
        for step in (1e-6, -1e-6):
            other, rotation = posture.copy(), start
            if 3 <= k < 6:
                rotation = turned(step * np.eye(3)[k - 3 : k - 2]) @ start
            else:
                other[:, k] += step
            ends.append(cloud.project(other, rotation, sides, facing)[0])
        found = (ends[0] - ends[1]) / 2e-6
        np.testing.assert_allclose(slopes[..., k], found, rtol=1e-4, atol=1e-3)
