"""Painted finger tips, ray-cast from two cameras: what the tests of paint compare with."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

RADIUS_M, PAINT_M, BASELINE_M, DISTANCE_M = 0.0068, 0.014, 0.075, 0.5
CAMERA_CENTRES = np.array([[0.0, 0.0, 0.0], [BASELINE_M, 0.0, 0.0]])


def visible_centroid(centre, tip, direction):
    """Centroid (x/z, y/z) of the painted part of a capsule that ends at tip.

    As a camera at centre sees it, looking along +z.
    """
    middle = tip - 0.5 * PAINT_M * direction - centre
    half = 1.3 * (PAINT_M + RADIUS_M) / middle[2]
    grid = np.linspace(-half, half, 160)
    rays = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2) + middle[:2] / middle[2]
    D = np.column_stack([rays, np.ones(len(rays))])
    D /= np.linalg.norm(D, axis=1, keepdims=True)
    w = centre - (tip - RADIUS_M * direction)  # from the centre of the end's sphere
    along, w_along = D @ direction, w @ direction
    a, b, c = 1.0 - along**2, D @ w - along * w_along, w @ w - w_along**2 - RADIUS_M**2
    t = (-b - np.sqrt(np.maximum(b**2 - a * c, 0.0))) / a
    cylinder = (b**2 > a * c) & (w_along + t * along <= 0.0)
    b_ball, c_ball = D @ w, w @ w - RADIUS_M**2
    ball = b_ball**2 > c_ball
    t = np.minimum(
        np.where(cylinder, t, np.inf),
        np.where(ball, -b_ball - np.sqrt(np.maximum(b_ball**2 - c_ball, 0.0)), np.inf),
    )
    hit = np.isfinite(t)
    depth_of_paint = -((w + np.where(hit, t, 0.0)[:, None] * D) @ direction) + RADIUS_M
    painted = hit & (depth_of_paint <= PAINT_M)
    return rays[painted].mean(axis=0) if painted.sum() > 20 else None


def _random_fingers(
    n: int, *, hidden: float = 0.9
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Random landmarks, finger directions, and where two cameras locate the visible centroid."""
    random = np.random.default_rng(0)
    found = 0
    while found < n:
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        if direction[2] > hidden:  # the finger hides its own tip
            continue
        point = np.array([random.uniform(-0.06, 0.14), random.uniform(-0.1, 0.1), DISTANCE_M])
        seen = [
            visible_centroid(centre, point + 0.5 * PAINT_M * direction, direction)
            for centre in CAMERA_CENTRES
        ]
        if seen[0] is None or seen[1] is None:
            continue
        found += 1
        z = BASELINE_M / (seen[0][0] - seen[1][0])
        yield point, direction, np.array([seen[0][0] * z, 0.5 * (seen[0][1] + seen[1][1]) * z, z])


def _split(error, point):
    """An error along the mean viewing ray, and its length across it."""
    away = point - CAMERA_CENTRES.mean(axis=0)
    away /= np.linalg.norm(away)
    return error @ away, np.linalg.norm(error - (error @ away) * away)


@pytest.fixture(scope="session")
def random_fingers() -> Callable[..., Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """n fingers of 6.8 mm radius, painted over 14 mm, half a metre from cameras 75 mm apart."""
    return _random_fingers


@pytest.fixture(scope="session")
def split() -> Callable[..., tuple[float, float]]:
    """An error -> along and across the viewing ray."""
    return _split
