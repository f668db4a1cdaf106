"""Vanishing points: near, at infinity, among other edges, and how sure."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from studies.grasp.metrology.segments import detected, segment_of
from studies.grasp.metrology.vanishing import strongest, vanishing_line, vanishing_point


def edges_to(point, rng, number=8, length=80.0, sigma=0.0):
    """Segments (n, 2, 2) of a 640x480 picture that meet at a homogeneous point (3,)."""
    middle = rng.uniform((60, 60), (580, 420), (number, 2))
    towards = np.asarray(point[:2]) - point[2] * middle
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    ends = middle[:, None] + 0.5 * length * np.array([-1.0, 1.0])[None, :, None] * towards[:, None]
    return ends + rng.normal(0.0, sigma, ends.shape)


def off_deg(found, point):
    """Angle between directions in the scaled coordinates."""
    wanted = np.linalg.solve(found.scale.matrix, np.asarray(point, float))
    cosine = abs(found.direction @ wanted) / np.linalg.norm(wanted)
    return np.degrees(np.arccos(min(cosine, 1.0)))


@pytest.mark.parametrize("point", [(900.0, 100.0, 1.0), (-4000.0, 300.0, 1.0), (1.0, 0.2, 0.0)])
def test_edges_meet_where_they_meet_and_at_infinity(point):
    rng = np.random.default_rng(4)
    found = vanishing_point(edges_to(point, rng), 0.5)
    assert off_deg(found, point) < 1e-6
    assert found.at_infinity() == (point[2] == 0.0)


def test_edges_of_other_directions_are_left_out():
    rng = np.random.default_rng(5)
    point = (1500.0, 200.0, 1.0)
    mine = edges_to(point, rng, 12, sigma=0.4)
    others = edges_to((200.0, -900.0, 1.0), rng, 7, sigma=0.4)
    found = vanishing_point(np.concatenate([others, mine]), 0.4)
    assert off_deg(found, point) < 1.5
    assert found.inliers[7:].sum() >= 11
    assert found.inliers[:7].sum() <= 1


def test_its_covariance_is_what_repeated_noise_gives():
    rng = np.random.default_rng(6)
    point = (1200.0, 500.0, 1.0)
    clean = edges_to(point, rng, 10, length=120.0)
    one = vanishing_point(clean, 0.5)
    found = [
        vanishing_point(clean + rng.normal(0, 0.5, clean.shape), 0.5, scale=one.scale).direction
        for _ in range(120)
    ]
    off = np.array([d * np.sign(d @ one.direction) - one.direction for d in found])
    seen = np.sqrt(np.diag(off.T @ off / len(off)))
    assert np.allclose(seen, np.sqrt(np.diag(one.covariance)), rtol=0.2)


def test_a_picture_s_own_edges_give_its_two_directions():
    """A board of bright squares, seen at a slant; its edges detected."""
    import cv2

    H = np.array([[2.2, -0.3, 150.0], [0.5, 1.9, 90.0], [0.0011, 0.0004, 1.0]])
    board = np.zeros((200, 240), np.uint8)
    board[(np.indices(board.shape) // 40).sum(axis=0) % 2 == 1] = 200
    picture = cv2.warpPerspective(board, H, (640, 480), borderValue=90)
    picture = cv2.GaussianBlur(picture, (0, 0), 1.0)
    u, v = strongest(detected(picture), 2)
    off = [min(off_deg(one, H[:, 0]), off_deg(one, H[:, 1])) for one in (u, v)]
    assert max(off) < 1.5
    line, covariance = vanishing_line(u, v)
    wanted = np.cross(H[:, 0], H[:, 1])
    assert abs(line @ wanted) / np.linalg.norm(wanted) > 1.0 - 1e-6
    assert np.all(np.diag(covariance) >= 0.0)


@pytest.mark.parametrize(
    ("edges", "text"),
    [
        ([[(0, 0), (10, 0)]], "needs 2 segments"),
        ([[(0, 0), (10, 0)], [(20, 0), (40, 0)]], "lie on one line"),
    ],
)
def test_what_says_no_direction_is_told(edges, text):
    with pytest.raises(CalibrationError, match=text):
        vanishing_point(edges)


def test_a_segment_is_the_line_through_all_points():
    assert np.allclose(segment_of([(3, 1), (1, 1), (2, 1)])[:, 1], 1.0)
    with pytest.raises(CalibrationError, match="two points that are apart"):
        segment_of([(3, 1), (3, 1)])
