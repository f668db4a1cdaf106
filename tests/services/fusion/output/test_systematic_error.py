"""Systematic errors: what is split off, and the covariance of what is left."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.observations import View
from services.fusion.output.systematic_error import (
    OWN_PX,
    OWN_SHARE,
    SHARED_SHARE,
    WHITE_PX,
    WHITE_SHARE,
    SystematicError,
    add_systematic,
)
from testing.synthetic_points import SyntheticRig

CAMERAS = tuple(SyntheticRig(distortion=(0.0,) * 5).rig().values())
FOCAL_PX = CAMERAS[0].focal_px[0]
DISTANCE_M = 0.6
POINTS = np.tile([0.0375, 0.0, DISTANCE_M], (2, 1))
BOTH = np.ones((2, 2), dtype=bool)
WHOLE = np.zeros((2, 2, 2))


@pytest.fixture
def errors() -> SystematicError:
    """Landmark 0 is paint, landmark 1 a point."""
    return SystematicError(np.array([True, False]), CAMERAS)


def view(sigma_px: float, camera: int = 0) -> View:
    return View(
        camera=camera,
        instant_ns=0,
        landmarks=np.array([0, 1]),
        delay_s=np.zeros(2),
        rays=np.zeros((2, 2)),
        sigmas=np.full(2, sigma_px / FOCAL_PX),
        areas=np.zeros(2),
        cut=np.zeros(2, dtype=np.bool_),
        clock_offset_ns=0,
        clock_sigma_s=0.0,
        ignored=0,
    )


def covariances(errors: SystematicError, points: Array, seen_by: Bools, hidden: Array) -> Array:
    """What is added to the covariances of points; (2, 3, 3)."""
    added = np.zeros((2, 3, 3))
    add_systematic(errors.known, hidden, points, seen_by, extrinsics(CAMERAS), added)
    return added


def test_only_a_part_of_a_large_sigma_is_noise(errors):
    paint_px, point_px = errors.white_sigmas(view(0.3), np.zeros(2)) * FOCAL_PX
    assert paint_px == pytest.approx(np.hypot(WHITE_PX, 0.3 * WHITE_SHARE), rel=0.01)
    assert point_px == pytest.approx(0.3)
    # What is hidden of paint comes on top.
    hidden = np.array([0.4, 0.0]) / FOCAL_PX
    more_px, _ = errors.white_sigmas(view(0.3), hidden) * FOCAL_PX
    assert more_px == pytest.approx(np.hypot(paint_px, 0.4))
    # A small sigma is not made larger.
    assert errors.white_sigmas(view(0.05), np.zeros(2))[0] * FOCAL_PX == pytest.approx(0.05)


def test_own_errors_are_disparity_and_shared_ones_are_not(errors):
    for _ in range(100):
        errors.white_sigmas(view(0.2), np.zeros(2))
    found = covariances(errors, POINTS, BOTH, WHOLE)
    depth_per_px = DISTANCE_M**2 / (FOCAL_PX * 0.075)
    assert np.sqrt(found[0, 2, 2]) == pytest.approx(np.sqrt(2.0) * OWN_PX * depth_per_px, rel=0.02)
    across = np.hypot(SHARED_SHARE * 0.2, OWN_PX / np.sqrt(2.0)) * DISTANCE_M / FOCAL_PX
    assert np.sqrt(found[0, 1, 1]) == pytest.approx(across, rel=0.03)
    assert not found[1].any()


def test_a_point_seen_by_one_camera_counts_as_seen_by_all(errors):
    one = np.array([[True, False], [True, False]])
    np.testing.assert_array_equal(
        covariances(errors, POINTS, one, WHOLE), covariances(errors, POINTS, BOTH, WHOLE)
    )


def test_points_behind_the_cameras_add_nothing_and_nan_nowhere(errors):
    errors.white_sigmas(view(0.2), np.zeros(2))
    assert not covariances(errors, -POINTS, BOTH, WHOLE).any()
    assert np.isfinite(covariances(errors, POINTS * 1e6, BOTH, WHOLE)).all()


def test_a_ray_that_paint_is_hidden_from_is_off_by_so_much(errors):
    hidden = WHOLE.copy()
    hidden[0, 0, 1] = 2.0 / FOCAL_PX
    more = covariances(errors, POINTS, BOTH, hidden) - covariances(errors, POINTS, BOTH, WHOLE)
    assert np.sqrt(more[0, 2, 2]) == pytest.approx(
        2.0 * DISTANCE_M**2 / (FOCAL_PX * 0.075), rel=0.02
    )
    assert not more[1].any()


def test_paint_that_is_hidden_from_all_is_off_sideways_and_a_little_in_depth(errors):
    hidden = WHOLE.copy()
    hidden[1, 0] = 2.0 / FOCAL_PX
    more = covariances(errors, POINTS, BOTH, hidden) - covariances(errors, POINTS, BOTH, WHOLE)
    sideways_m, depth_m = np.sqrt(more[0, 0, 0]), np.sqrt(more[0, 2, 2])
    assert sideways_m == pytest.approx(2.0 * DISTANCE_M / FOCAL_PX, rel=0.05)
    own_px = OWN_SHARE * 2.0 * np.sqrt(2.0)
    assert depth_m == pytest.approx(own_px * DISTANCE_M**2 / (FOCAL_PX * 0.075), rel=0.05)
    assert not more[1].any()
