"""The rigid fit with a lever arm from points measured otherwise: exact, at any turn, and real."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rhot.errors import CalibrationError
from rhot.geometry.transforms import apply, inverse, transform
from services.calibrator.objects.points import register_points

MARKER_M = np.array([0.02, -0.05, 0.11])


def measured(T, rotations, random):
    """Points of the rig and the tracker's poses (n, 4, 4) that see MARKER_M there."""
    points = random.uniform(-1.0, 1.0, (len(rotations), 3)) + np.array([0.0, 0.0, 2.0])
    inside = apply(inverse(T), points)
    poses = np.stack(
        [transform(R, p - R @ MARKER_M) for R, p in zip(rotations, inside, strict=True)]
    )
    return points, poses


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 180.0])
@pytest.mark.parametrize("axis", range(3))
def test_exact_points_give_the_exact_frame_at_180_deg_too(turn_deg, axis):
    random = np.random.default_rng(1)
    T = transform(Rotation.from_euler("xyz"[axis], turn_deg, degrees=True).as_matrix(), [1, 2, 3])
    # The trackers themselves are at 180 deg exactly, about every axis, and elsewhere.
    half = [np.diag(signs) for signs in ([1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])]
    rotations = np.array([*half, *Rotation.random(9, random_state=2).as_matrix()])
    found = register_points(*measured(T, rotations, random))
    assert found.T_rig_from_lighthouse == pytest.approx(T, abs=1e-9)
    assert found.marker_m == pytest.approx(MARKER_M, abs=1e-9)
    assert found.rms_m < 1e-9


def test_a_tracker_that_never_turns_leaves_the_lever_arm_open_but_fits():
    random = np.random.default_rng(3)
    T = transform(Rotation.random(random_state=1).as_matrix(), [0.3, 0.2, 0.1])
    found = register_points(*measured(T, np.tile(np.eye(3), (8, 1, 1)), random))
    assert found.rms_m < 1e-9
    assert found.T_rig_from_lighthouse[:3, :3] == pytest.approx(T[:3, :3], abs=1e-9)
    assert np.linalg.norm(found.marker_m) < 1e-9


def test_too_few_points_and_points_on_a_line_are_refused():
    points = np.linspace(0.0, 1.0, 5)[:, None] * np.array([1.0, 0.5, 0.2])
    poses = np.tile(np.eye(4), (5, 1, 1))
    with pytest.raises(CalibrationError, match="3 points and 3 poses"):
        register_points(points[:3], poses[:3])
    with pytest.raises(CalibrationError, match="on a line"):
        register_points(points, poses)
