"""Where the centroid of a painted finger tip is: by ray-casting two cameras, against the constants of surface.py."""

from __future__ import annotations

import numpy as np

from services.fusion.surface import MEAN_PUSH, SIGMA_ACROSS, SIGMA_ALONG, to_axis

RADIUS_M, PAINT_M, BASELINE_M, DISTANCE_M = 0.0068, 0.014, 0.075, 0.5
EYES = np.array([[0.0, 0.0, 0.0], [BASELINE_M, 0.0, 0.0]])


def visible_centroid(eye, tip, direction):
    """Centroid (x/z, y/z) of the painted part of a capsule that ends at tip, as seen from eye looking along +z."""
    middle = tip - 0.5 * PAINT_M * direction - eye
    half = 1.3 * (PAINT_M + RADIUS_M) / middle[2]
    grid = np.linspace(-half, half, 160)
    rays = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2) + middle[:2] / middle[2]
    D = np.column_stack([rays, np.ones(len(rays))])
    D /= np.linalg.norm(D, axis=1, keepdims=True)
    w = eye - (tip - RADIUS_M * direction)  # from the centre of the end's sphere
    along, w_along = D @ direction, w @ direction
    a, b, c = 1.0 - along**2, D @ w - along * w_along, w @ w - w_along**2 - RADIUS_M**2
    t = (-b - np.sqrt(np.maximum(b**2 - a * c, 0.0))) / a
    cylinder = (b**2 > a * c) & (w_along + t * along <= 0.0)
    b_ball, c_ball = D @ w, w @ w - RADIUS_M**2
    ball = b_ball**2 > c_ball
    t = np.minimum(np.where(cylinder, t, np.inf), np.where(ball, -b_ball - np.sqrt(np.maximum(b_ball**2 - c_ball, 0.0)), np.inf))
    hit = np.isfinite(t)
    depth_of_paint = -((w + np.where(hit, t, 0.0)[:, None] * D) @ direction) + RADIUS_M
    painted = hit & (depth_of_paint <= PAINT_M)
    return rays[painted].mean(axis=0) if painted.sum() > 20 else None


def errors() -> np.ndarray:
    """Triangulated centroid minus the middle of the painted axis, along the mean viewing ray and across it; (n, 2)."""
    random, rows = np.random.default_rng(0), []
    while len(rows) < 150:
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        if direction[2] > 0.9:  # the finger hides its own tip
            continue
        point = np.array([random.uniform(-0.06, 0.14), random.uniform(-0.1, 0.1), DISTANCE_M])
        seen = [visible_centroid(eye, point + 0.5 * PAINT_M * direction, direction) for eye in EYES]
        if seen[0] is None or seen[1] is None:
            continue
        z = BASELINE_M / (seen[0][0] - seen[1][0])
        error = np.array([seen[0][0] * z, 0.5 * (seen[0][1] + seen[1][1]) * z, z]) - point
        away = point - EYES.mean(axis=0)
        away /= np.linalg.norm(away)
        rows.append((error @ away, np.linalg.norm(error - (error @ away) * away)))
    return np.array(rows)


def test_the_constants_are_what_ray_casting_gives():
    along, across = errors().T
    assert abs(along.mean() + MEAN_PUSH * RADIUS_M) < 0.5e-3
    assert abs(along.std() / RADIUS_M - SIGMA_ALONG) < 0.06
    assert abs(np.sqrt(np.mean(across**2) / 2.0) / RADIUS_M - SIGMA_ACROSS) < 0.03
    # A push by the whole radius, as if the centroid lay on the skin, would be far off.
    assert abs(along.mean() + RADIUS_M) > 5e-3


def test_points_move_away_from_the_cameras_and_flat_dabs_stay():
    positions, covs = np.array([[0.1, 0.2, 0.5], [0.1, 0.2, 0.5]]), np.tile(1e-6 * np.eye(3), (2, 1, 1))
    eye = np.array([0.0375, 0.0, 0.0])
    moved, blurred = to_axis(positions, covs, np.array([0.0068, 0.0]), eye)
    away = (positions[0] - eye) / np.linalg.norm(positions[0] - eye)
    np.testing.assert_allclose(moved[0], positions[0] + MEAN_PUSH * 0.0068 * away)
    np.testing.assert_array_equal(moved[1], positions[1])
    np.testing.assert_array_equal(blurred[1], covs[1])
    assert np.sqrt(away @ blurred[0] @ away) > np.sqrt(1e-6)
    assert np.isfinite(to_axis(np.array([eye]), covs[:1], np.array([0.01]), eye)[0]).all()
