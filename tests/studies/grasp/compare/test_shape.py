"""Distances of paths: what counts, and what does not."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.compare.shape import procrustes, warped, warping

ANGLE = np.linspace(0.0, 2.5, 50)
SPIRAL = np.column_stack([np.cos(ANGLE), np.sin(ANGLE)]) * (1.0 - 0.2 * ANGLE)[:, None]


def test_turning_and_shifting_make_no_difference_to_procrustes():
    c, s = np.cos(0.7), np.sin(0.7)
    moved = SPIRAL @ np.array([[c, s], [-s, c]]) + [0.3, -0.2]
    found = procrustes(moved, SPIRAL)
    assert found.distance < 1e-9
    assert found.turn_rad == pytest.approx(-0.7)
    assert found.path == pytest.approx(SPIRAL)
    # Size does.
    assert procrustes(1.1 * SPIRAL, SPIRAL).distance > 0.04


def test_pace_makes_no_difference_to_warping():
    slow_start = SPIRAL[np.round(49 * np.linspace(0, 1, 50) ** 1.3).astype(int)]
    assert procrustes(slow_start, SPIRAL).distance > 0.05
    found = warping(slow_start, SPIRAL)
    assert found.distance < 0.02
    # Its frames are paired with earlier ones: it comes later.
    assert found.lag > 0.03
    assert (np.diff(found.pairs, axis=0) >= 0).all()
    assert found.pairs[[0, -1]].tolist() == [[0, 0], [49, 49]]
    assert np.abs(warped(slow_start, SPIRAL) - SPIRAL).max() < 0.05


def test_paths_of_different_lengths_are_paired_from_end_to_end():
    found = warping(SPIRAL[::3], SPIRAL)
    assert found.pairs[[0, -1]].tolist() == [[0, 0], [16, 49]]
    assert found.distance < 0.1
