"""Intersections of rays and capsules against plain geometry."""

from __future__ import annotations

import numpy as np
import pytest

from services.simulator.render.ray_capsule import (
    FAR,
    PLACED,
    NearestHits,
    intersect,
    intersect_row,
    place_capsule,
)


def placed(a, b, ra: float, rb: float) -> np.ndarray:
    ends = np.zeros((2, 3, 3))
    ends[0, 0], ends[1, 0] = a, b
    g = np.zeros(PLACED)
    place_capsule(ends, np.array([ra, rb]), 0.0, g)
    return g


def distance_to(
    points: np.ndarray, a: np.ndarray, b: np.ndarray, ra: float, rb: float
) -> np.ndarray:
    """Signed distance of points (n, 3) to the hull of two balls, by dense sampling of the balls
    between them.
    """
    s = np.linspace(0.0, 1.0, 4001)[:, None]
    middles, radii = a + s * (b - a), ra + s[:, 0] * (rb - ra)
    # The hull of two balls is the union of the balls between them whose radius grows linearly.
    return np.array([np.min(np.linalg.norm(p - middles, axis=1) - radii) for p in points])


@pytest.mark.parametrize(
    ("a", "b", "ra", "rb"),
    [
        ((0.0, 0.0, 0.5), (0.05, 0.02, 0.55), 0.01, 0.01),
        ((0.01, 0.0, 0.5), (0.0, 0.06, 0.45), 0.02, 0.012),
        ((0.0, 0.0, 0.5), (0.0, 0.0, 0.54), 0.009, 0.007),
        ((0.0, 0.0, 0.54), (0.001, 0.0, 0.5), 0.009, 0.007),
        ((0.0, 0.0, 0.5), (0.0, 0.003, 0.5), 0.02, 0.01),
        ((0.0, 0.0, 0.5), (0.0, 0.0, 0.5), 0.01, 0.01),
    ],
    ids=["cylinder", "tapered", "end on", "end on, thin end first", "ball in ball", "ball"],
)
def test_hits_lie_on_the_nearest_surface(a, b, ra, rb):
    a, b = np.array(a), np.array(b)
    g = placed(a, b, ra, rb)
    rng = np.random.default_rng(2)
    targets = 0.5 * (a + b) + rng.uniform(-0.03, 0.03, (300, 3)) * (1, 1, 0.2)
    rays = targets / np.linalg.norm(targets, axis=1, keepdims=True)
    results = [intersect(g, *ray) for ray in rays]
    t = np.array([r[0] for r in results])
    on = t < FAR
    assert 10 < on.sum() < 290
    np.testing.assert_allclose(distance_to(t[on, None] * rays[on], a, b, ra, rb), 0.0, atol=1e-6)
    # Nothing lies before a hit, and nothing on the way of a miss.
    for ray, reach in zip(rays[:60], t[:60], strict=True):
        way = np.linspace(0.3, min(reach, 0.8) - 1e-4, 60)[:, None] * ray
        assert np.all(distance_to(way, a, b, ra, rb) > -1e-6)


def test_rows_are_rays_side_by_side():
    rng = np.random.default_rng(3)
    g = placed((0.0, 0.0, 0.5), (0.04, 0.03, 0.48), 0.012, 0.009)
    rays = np.stack([np.linspace(-0.1, 0.15, 80), rng.uniform(-0.03, 0.05, 80), np.ones(80)])
    rays = (rays / np.linalg.norm(rays, axis=0)).astype(np.float32)
    nearest = NearestHits(np.full(80, FAR), np.zeros(80), np.full(80, -1))
    nearest.distance[10:20] = 0.1  # something nearer
    intersect_row(g, rays, 2, 77, 5, nearest)
    for i in range(80):
        t, along = intersect(g, *(float(v) for v in rays[:, i]))
        if 2 <= i <= 77 and not 10 <= i < 20:
            assert nearest.distance[i] == pytest.approx(t, abs=1e-12)
            if t < FAR:
                assert nearest.along[i] == pytest.approx(along, abs=1e-9)
                assert nearest.capsule[i] == 5
        else:
            assert nearest.capsule[i] == -1
