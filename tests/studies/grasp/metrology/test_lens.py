"""A lens from edges that are straight in the world."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.geometry.camera import distort
from studies.grasp.metrology.lens import assumed_matrix, lens_from_edges, straightened

SIZE = (640, 480)
TRUE = np.array([-0.26, 0.09, 0.0, 0.0, 0.0])


def bent(lines, rng=None, sigma=0.0):
    """Points of straight lines as the lens shows them, in px; kept inside the picture."""
    K = assumed_matrix(SIZE)
    found = []
    for first, last in lines:
        share = np.linspace(0, 1, 20)[:, None]
        rays = (np.asarray(first) * (1 - share) + np.asarray(last) * share - K[:2, 2]) / K[0, 0]
        px = distort(rays, TRUE) * K[0, 0] + K[:2, 2]
        px = px[((px >= 0) & (px < SIZE)).all(axis=1)]
        found.append(px + (rng.normal(0, sigma, px.shape) if rng else 0.0))
    return found


LINES = [
    ((20, 30), (620, 45)),
    ((15, 440), (630, 425)),
    ((40, 5), (25, 470)),
    ((600, 10), (590, 470)),
]


def test_bent_edges_give_the_lens():
    lens = lens_from_edges(bent(LINES), SIZE)
    assert np.allclose(lens.distortion, TRUE, atol=4e-3)
    assert lens.rms_px < 0.01 < lens.bend_px
    for edge in bent(LINES):
        flat = straightened(edge, lens.matrix, lens.distortion)
        assert np.linalg.svd(flat - flat.mean(0), compute_uv=False)[1] < 0.1


def test_its_sigma_is_what_repeated_noise_gives():
    rng = np.random.default_rng(2)
    told = np.sqrt(np.diag(lens_from_edges(bent(LINES), SIZE, 0.3).covariance))
    found = [lens_from_edges(bent(LINES, rng, 0.3), SIZE, 0.3).distortion[:2] for _ in range(40)]
    assert np.allclose(np.std(found, axis=0), told, rtol=0.35)
    assert np.abs(np.mean(found, axis=0) - TRUE[:2]).max() < 2.0 * told.max()


def test_one_edge_that_is_not_straight_does_not_bend_the_lens():
    edges = bent(LINES)
    x = np.linspace(80, 400, 20)
    edges.append(np.c_[x, 200 + 12.0 * np.sin(x / 50.0)])
    assert np.allclose(lens_from_edges(edges, SIZE).distortion[:2], TRUE[:2], atol=0.05)


def test_edges_too_short_to_bend_are_told():
    with pytest.raises(CalibrationError, match="span 80 px"):
        lens_from_edges([[(0, 0), (5, 0), (9, 0)]], SIZE)
