"""What does not average out, against what it is made of."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.intake.observations import View
from services.fusion.output.systematic_error import (
    OWN_PX,
    SHARED_SHARE,
    WHITE_PX,
    WHITE_SHARE,
    Bias,
)
from testing.synthetic_points import Setup

CAMERAS = tuple(Setup(distortion=(0.0,) * 5).rig().values())
FOCAL_PX = CAMERAS[0].focal_px[0]
DISTANCE_M = 0.6
POINTS = np.tile([0.0375, 0.0, DISTANCE_M], (2, 1))
BOTH = np.ones((2, 2), dtype=bool)


@pytest.fixture
def bias() -> Bias:
    """Slot 0 is paint, slot 1 a point."""
    return Bias(np.array([True, False]), CAMERAS)


def view(sigma_px: float, camera: int = 0) -> View:
    slots = np.array([0, 1])
    return View(
        camera,
        0,
        0,
        slots,
        np.zeros(2),
        np.zeros((2, 2)),
        np.full(2, sigma_px / FOCAL_PX),
        0,
        0.0,
        0,
    )


def test_only_a_part_of_a_large_sigma_is_noise(bias):
    paint_px, point_px = bias.note(view(0.3)) * FOCAL_PX
    assert paint_px == pytest.approx(np.hypot(WHITE_PX, 0.3 * WHITE_SHARE), rel=0.01)
    assert point_px == pytest.approx(0.3)
    # A small sigma is not made larger.
    assert bias.note(view(0.05))[0] * FOCAL_PX == pytest.approx(0.05)


def test_own_errors_are_disparity_and_shared_ones_are_not(bias):
    for _ in range(100):
        bias.note(view(0.2))
    covariances = bias.covariances(POINTS, BOTH)
    depth_per_px = DISTANCE_M**2 / (FOCAL_PX * 0.075)
    assert np.sqrt(covariances[0, 2, 2]) == pytest.approx(
        np.sqrt(2.0) * OWN_PX * depth_per_px, rel=0.02
    )
    across = np.hypot(SHARED_SHARE * 0.2, OWN_PX / np.sqrt(2.0)) * DISTANCE_M / FOCAL_PX
    assert np.sqrt(covariances[0, 1, 1]) == pytest.approx(across, rel=0.03)
    assert not covariances[1].any()


def test_a_point_seen_by_one_camera_is_judged_as_if_by_all(bias):
    one = np.array([[True, False], [True, False]])
    np.testing.assert_array_equal(bias.covariances(POINTS, one), bias.covariances(POINTS, BOTH))


def test_points_behind_the_cameras_add_nothing_and_nan_nowhere(bias):
    bias.note(view(0.2))
    assert not bias.covariances(-POINTS, BOTH).any()
    assert np.isfinite(bias.covariances(POINTS * 1e6, BOTH)).all()
