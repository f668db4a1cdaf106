"""Rays, capsules and their paths against plain geometry."""

from __future__ import annotations

import numpy as np
import pytest

from services.simulator.render.motion_paths import columns_of, parabola, rows_of
from services.simulator.render.ray_capsule import (
    FAR,
    PLACED,
    hit,
    hit_row,
    lens_of,
    place,
    project,
    rays_of,
)


def placed(a, b, ra: float, rb: float) -> np.ndarray:
    ends = np.zeros((2, 3, 3))
    ends[0, 0], ends[1, 0] = a, b
    g = np.zeros(PLACED)
    place(ends, ra, rb, 0.0, g)
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
    results = [hit(g, *ray) for ray in rays]
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
    depth, reach, owner = np.full(80, FAR), np.zeros(80), np.full(80, -1)
    depth[10:20] = 0.1  # something nearer
    hit_row(g, rays, 2, 77, 5, depth, owner, reach)
    for i in range(80):
        t, along = hit(g, *(float(v) for v in rays[:, i]))
        if 2 <= i <= 77 and not 10 <= i < 20:
            assert depth[i] == pytest.approx(t, abs=1e-12)
            if t < FAR:
                assert reach[i] == pytest.approx(along, abs=1e-9)
                assert owner[i] == 5
        else:
            assert owner[i] == -1


def test_projection_is_the_cameras(fist):
    rng = np.random.default_rng(4)
    for camera in fist.cameras.values():
        points = rng.uniform((-0.25, -0.25, 0.35), (0.25, 0.25, 0.85), (50, 3))
        ours = np.array([project(lens_of(camera), *p) for p in points])
        np.testing.assert_allclose(ours, camera.project_camera(points), atol=1e-9)


def test_rays_undo_the_projection(fist):
    camera = fist.cameras["left"]
    rays = rays_of(camera)
    assert rays.shape == (480, 3, 640)
    for x, y in ((0, 0), (639, 479), (320, 240), (17, 401)):
        np.testing.assert_allclose(
            camera.project_camera(rays[y, :, x].astype(float) * 0.7)[0], (x, y), atol=2e-4
        )


def test_parabolas_meet_their_three_instants():
    at = np.random.default_rng(5).normal(size=(3, 4))
    out = np.empty((3, 4))
    parabola(at[0], at[1], at[2], out)
    for u, value in zip((-1.0, 0.0, 1.0), at, strict=True):
        np.testing.assert_allclose(out[0] + u * out[1] + u * u * out[2], value, atol=1e-12)


def test_rows_and_columns_bound_what_is_drawn():
    tracks = np.zeros((1, 2, 3, 3))
    tracks[0, 0, 0], tracks[0, 1, 0] = (100.0, 50.0, 10.0), (200.0, 90.0, 6.0)
    spans = np.empty((1, 2), np.int64)
    rows_of(tracks, 480, spans)
    assert spans[0, 0] <= 40
    assert 96 <= spans[0, 1] <= 105
    first, last = columns_of(tracks[0], 0.0, 70, 640)
    assert first < 125
    assert last > 175
    assert columns_of(tracks[0], 0.0, 20, 640) == (0, -1)
    # Far outside the picture nothing is left.
    tracks[0, :, 0, 0] += 2000.0
    low, high = columns_of(tracks[0], 0.0, 70, 640)
    assert high < low
