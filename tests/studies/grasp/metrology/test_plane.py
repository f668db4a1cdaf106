"""Planes: from rectangles, lengths and edges; what they say of sizes, and how sure they are."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.geometry.transforms import rotation_x, rotation_y, rotation_z
from studies.grasp.metrology.finger import finger_in_plane, points_in_plane
from studies.grasp.metrology.plane import (
    plane_from_length,
    plane_from_points,
    plane_from_rectangle,
    plane_from_view,
    project,
)
from studies.grasp.metrology.pose import plane_seen_by_camera
from studies.grasp.metrology.space import space_from_height, space_from_lens
from studies.grasp.metrology.view import view_from_edges

K = np.array([[700.0, 0.0, 319.5], [0.0, 700.0, 239.5], [0.0, 0.0, 1.0]])
SIZE = (640, 480)
CORNERS = np.array([(0.0, 0.0), (80.0, 0.0), (80.0, 50.0), (0.0, 50.0)])


def camera(tilt_deg, turn_deg=8.0, distance=330.0):
    """P (3, 4) of mm in space to homogeneous pixels: a plane z = 0, tilted, before the camera."""
    tilt = np.radians(tilt_deg)
    R = rotation_z(np.radians(turn_deg)) @ rotation_y(tilt) @ rotation_x(0.5 * tilt)
    return K @ np.c_[R, (-35.0, -20.0, distance)]


def seen(P, points_mm, z=0.0):
    flat = np.asarray(points_mm, float).reshape(-1, 2)
    return project(P[:, [0, 1, 3]] + np.c_[np.zeros((3, 2)), z * P[:, 2]], flat)


def grid_edges(P):
    """Edges of a rectangle of 160x100 mm about the middle, along x and along y; (3, 2, 2) each."""
    x = [[(-40, y), (120, y)] for y in (-25.0, 25.0, 75.0)]
    y = [[(x, -25), (x, 75)] for x in (-40.0, 40.0, 120.0)]
    return seen(P, x).reshape(-1, 2, 2), seen(P, y).reshape(-1, 2, 2)


@pytest.mark.parametrize("tilt", [0.0, 15.0, 40.0])
def test_a_rectangle_gives_lengths_elsewhere_in_its_plane(tilt):
    P = camera(tilt)
    plane = plane_from_rectangle(seen(P, CORNERS), (80.0, 50.0), 0.5)
    points = np.array([(-50.0, 70.0), (60.0, 90.0), (110.0, -20.0)])
    assert np.allclose(plane.to_mm(seen(P, points)), points, atol=1e-6)
    assert np.allclose(plane.to_px(points), seen(P, points), atol=1e-6)
    line = np.cross(P[:, 0], P[:, 1])
    assert np.allclose(np.abs(plane.vanishing_line @ line / np.linalg.norm(line)), 1.0)


def test_a_lengths_sigma_is_what_repeated_clicks_give():
    rng = np.random.default_rng(3)
    P = camera(25.0)
    corners, ends = seen(P, CORNERS), seen(P, [(-30.0, 60.0), (70.0, 85.0)])
    _, sigma = plane_from_rectangle(corners, (80.0, 50.0), 0.7).distance(*ends, 0.7)
    found = []
    for _ in range(200):
        noisy = plane_from_rectangle(corners + rng.normal(0, 0.7, (4, 2)), (80.0, 50.0), 0.7)
        found.append(noisy.distance(*(ends + rng.normal(0, 0.7, (2, 2))), 0.7)[0])
    assert np.std(found) == pytest.approx(sigma, rel=0.15)


@pytest.mark.parametrize("tilt", [0.0, 4.0, 30.0])
def test_edges_and_one_length_give_the_plane_of_a_calibrated_lens(tilt):
    P = camera(tilt)
    view = view_from_edges(*grid_edges(P), SIZE, sigma_px=0.3, matrix=K)
    plane = plane_from_view(view, *seen(P, CORNERS[:2]), 80.0, 0.3)
    for first, second in (
        (CORNERS[1], CORNERS[2]),
        ((-30, 60), (70, 85)),
        (CORNERS[0], CORNERS[2]),
    ):
        wanted = np.hypot(*(np.subtract(second, first)))
        found, sigma = plane.distance(*seen(P, [first, second]), 0.3)
        assert found == pytest.approx(wanted, rel=1e-6)
        assert 0.05 < sigma < 1.5


def test_edges_alone_tell_the_focal_length_of_a_slanted_view_only():
    """Square to the plane nothing says it, lengths are right all the same."""
    slanted, square = camera(35.0), camera(0.0)
    found = view_from_edges(*grid_edges(slanted), SIZE, sigma_px=0.1)
    sigma = np.sqrt(found.covariance[3, 3])
    assert abs(np.log(found.focal_px / 700.0)) < 2.5 * sigma
    assert sigma < 0.2
    view = view_from_edges(*grid_edges(square), SIZE, sigma_px=0.1)
    assert np.sqrt(view.covariance[3, 3]) > 0.25
    plane = plane_from_view(view, *seen(square, CORNERS[:2]), 80.0, 0.1)
    length, _ = plane.distance(*seen(square, [(0, 0), (0, 50)]), 0.1)
    assert length == pytest.approx(50.0, rel=1e-3)


def test_an_edges_plane_is_as_sure_as_repeated_noise():
    rng = np.random.default_rng(9)
    P = camera(20.0)
    x, y = grid_edges(P)
    ends, ref = seen(P, [(0, 0), (0, 50.0)]), seen(P, CORNERS[:2])
    view = view_from_edges(x, y, SIZE, sigma_px=0.3, matrix=K)
    _, sigma = plane_from_view(view, *ref, 80.0, 0.3).distance(*ends, 0.3)
    found = []
    for _ in range(40):
        noise = [rng.normal(0, 0.3, one.shape) for one in (x, y, ref, ends)]
        view = view_from_edges(x + noise[0], y + noise[1], SIZE, sigma_px=0.3, matrix=K)
        plane = plane_from_view(view, *(ref + noise[2]), 80.0, 0.3)
        found.append(plane.distance(*(ends + noise[3]), 0.3)[0])
    assert np.std(found) == pytest.approx(sigma, rel=0.35)


def test_heights_and_parallel_planes_from_one_height_or_from_the_lens():
    """The A2 formula: heights above a slanted plane, and lengths in a plane above it."""
    P = camera(30.0)
    plane = plane_from_rectangle(seen(P, CORNERS), (80.0, 50.0), 0.3)
    base, top = seen(P, (10.0, 20.0)), seen(P, (10.0, 20.0), 25.0)
    spaces = (
        space_from_lens(plane, K),
        space_from_height(plane, P[:, 2], base[0], top[0], 25.0, 0.3),
    )
    other = seen(P, (70.0, -10.0)), seen(P, (70.0, -10.0), -18.0)
    for space in spaces:
        height, sigma = space.height(other[0][0], other[1][0], 0.3)
        assert height == pytest.approx(-18.0, rel=1e-5)
        assert 0.2 < sigma < 3.0
        above = space.parallel_plane(-18.0)
        assert np.allclose(above.to_mm(seen(P, CORNERS, -18.0)), CORNERS, atol=1e-4)
        assert np.allclose(
            project(space.homology(-18.0), seen(P, CORNERS)), seen(P, CORNERS, -18.0), atol=1e-4
        )


def test_a_heights_sigma_is_what_repeated_clicks_give():
    rng = np.random.default_rng(12)
    P = camera(30.0)
    points = [seen(P, CORNERS), seen(P, (70.0, -10.0)), seen(P, (70.0, -10.0), -18.0)]

    def height(corners, base, top):
        plane = plane_from_rectangle(corners, (80.0, 50.0), 0.5)
        return space_from_lens(plane, K).height(base[0], top[0], 0.5)

    sigma = height(*points)[1]
    found = [
        height(*(one + rng.normal(0, 0.5, one.shape) for one in points))[0] for _ in range(100)
    ]
    assert np.std(found) == pytest.approx(sigma, rel=0.25)


def test_a_fingers_angles_and_bones_with_the_sigmas_of_repeated_pictures():
    rng = np.random.default_rng(7)
    P = camera(20.0)
    mm = np.array([(-40, 5), (0, 5), (0, 5), (38, 12), (55, 28), (58, 45.0)])
    px, corners = seen(P, mm), seen(P, CORNERS)
    plane = plane_from_rectangle(corners, (80.0, 50.0), 0.5)
    sigma = np.array([0.4, 0.4, 0.4, 0.3, 0.3, 0.6])
    one = finger_in_plane(plane, np.stack([px, px]), np.stack([sigma, 0.0 * sigma]))
    steps = np.diff(mm[2:], axis=0)
    turned = np.arctan2(steps[:, 1], steps[:, 0])
    assert np.allclose(one.angles_rad[0], np.diff(np.append(0.0, turned)), atol=1e-8)
    assert np.allclose(one.lengths_mm[0], np.hypot(*steps.T), atol=1e-6)
    found = []
    for _ in range(200):
        noisy = plane_from_rectangle(corners + rng.normal(0, 0.5, (4, 2)), (80.0, 50.0), 0.5)
        places = px + rng.normal(0, 1, (6, 2)) * sigma[:, None]
        of = finger_in_plane(noisy, places, sigma)
        found.append(np.append(of.angles_rad, of.lengths_mm))
    seen_sigma = np.std(found, axis=0)
    told = np.append(one.angles_sigma_rad[0], one.lengths_sigma_mm[0])
    assert np.allclose(told, seen_sigma, rtol=0.2)
    # Without noise of the joints, the plane's share remains.
    assert np.allclose(one.angles_sigma_rad[1], one.plane_sigma[1, :3])
    points = points_in_plane(plane, px, sigma)
    assert np.allclose(points.points_mm, mm, atol=1e-6)
    assert (points.sigma_mm > 0.05).all()
    assert (points.shared_mm > 0.05).all()


def test_a_camera_knows_a_small_rectangles_plane_better_than_a_homography():
    """Far from it, with the sigma of repeated clicks."""
    rng = np.random.default_rng(8)
    P = camera(25.0)
    small, ends = CORNERS * 0.6, seen(P, [(-60.0, 90.0), (20.0, 100.0)])
    seen_small, true = seen(P, small), float(np.hypot(80.0, 10.0))
    plane = plane_seen_by_camera(seen_small, small, SIZE, sigma_px=0.4, matrix=K)
    found, sigma = plane.distance(*ends, 0.1)
    assert found == pytest.approx(true, rel=1e-3)
    off: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(25):
        noisy = seen_small + rng.normal(0, 0.4, (4, 2))
        for by_camera in off:
            plane = (
                plane_seen_by_camera(noisy, small, SIZE, sigma_px=0.4, matrix=K)
                if by_camera
                else plane_from_points(noisy, small, 0.4)
            )
            off[by_camera].append(plane.distance(*(ends + rng.normal(0, 0.1, (2, 2))))[0] - true)
    assert np.sqrt(np.mean(np.square(off[True]))) == pytest.approx(sigma, rel=0.4)
    assert np.std(off[True]) < 0.8 * np.std(off[False])


@pytest.mark.parametrize(
    ("corners", "size", "text"),
    [
        ([(0, 0), (10, 10), (20, 20), (5, 40)], (80, 50), "in a line"),
        ([(0, 0), (90, 5), (90, 5), (5, 80)], (80, 50), "two are one"),
        ([(0, 0), (90, 80), (90, 5), (5, 80)], (80, 50), "cross over"),
        ([(0, 0), (90, 5), (95, 85), (5, 80)], (0.08, 0.05), "metres.*did you mean 80"),
        ([(0, 0), (90, 5), (95, 85), (5, 80)], (80, 0), "0 mm long, which is no length"),
        ([(0, 0), (90, 5), (95, 85), (5, 80)], (80000, 50000), "too long beside a hand"),
    ],
)
def test_what_is_no_rectangle_is_told(corners, size, text):
    with pytest.raises(CalibrationError, match=text):
        plane_from_rectangle(corners, size)


def test_what_is_no_reference_length_is_told():
    with pytest.raises(CalibrationError, match="same point"):
        plane_from_length((10, 10), (10.5, 10), 80.0)
    assert plane_from_length((10, 10), (210, 10), 80.0).distance((0, 0), (0, 50))[0] == (
        pytest.approx(20.0)
    )
    with pytest.raises(CalibrationError, match="direction y has 1 edges"):
        view_from_edges([[(0, 0), (9, 0)], [(0, 9), (9, 9)]], [[(0, 0), (0, 9)]], SIZE)
