"""A rectangle's corners in a picture, from clicks that are off."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from studies.grasp.metrology.corners import corners_of

CORNERS = np.array([(60.3, 52.7), (241.6, 61.2), (236.4, 170.9), (52.1, 160.2)])


def picture(rng, frame_px=9.0):
    """A dark frame about a pale field, lit from a side, blurred, noisy, JPEG."""
    shade = np.linspace(150, 235, 300)[None, :].repeat(220, axis=0)
    big = cv2.resize(shade.astype(np.float32), (2400, 1760))
    middle = CORNERS.mean(axis=0)
    for corners, level in (
        (CORNERS, 0.3),
        (middle + (CORNERS - middle) * (1 - frame_px / 90), 0.8),
    ):
        mask = np.zeros(big.shape, np.uint8)
        cv2.fillPoly(mask, [np.round((corners + 0.5) * 8 - 0.5).astype(np.int32)], 1)
        big[mask > 0] = level * big[mask > 0].mean()
    small = cv2.GaussianBlur(cv2.resize(big, (300, 220), interpolation=cv2.INTER_AREA), (0, 0), 0.8)
    noisy = np.clip(small + rng.normal(0, 3.0, small.shape), 0, 255).astype(np.uint8)
    return cv2.imdecode(cv2.imencode(".jpg", noisy, [1, 70])[1], cv2.IMREAD_GRAYSCALE)


def same(px):
    return np.asarray(px, float)


def test_clicks_are_drawn_to_the_outer_edges():
    rng = np.random.default_rng(1)
    image = picture(rng)
    for _ in range(4):
        found = corners_of(image, CORNERS + rng.normal(0, 1.0, (4, 2)), 1.0, same)
        assert found.refined
        assert np.hypot(*(found.points_px - CORNERS).T).max() < 0.5
        assert found.sigma_px < 0.5


@pytest.mark.parametrize("kind", ["plain", "far"])
def test_without_edges_near_by_clicks_stay_clicks(kind):
    rng = np.random.default_rng(2)
    image = picture(rng)
    if kind == "plain":
        image = np.full_like(image, 120)
    clicks = CORNERS + (0.0 if kind == "plain" else (19.0, 17.0))
    found = corners_of(image, clicks, 1.0, same)
    assert not found.refined
    assert np.array_equal(found.points_px, clicks)
    assert found.sigma_px == 1.0
