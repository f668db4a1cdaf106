"""Distances to boxes, cylinders and spheres, against what any distance must satisfy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.geometry.solids import Box, Cylinder, Sphere, capsule_distance

SOLIDS = {
    "box": Box((0.06, 0.1, 0.03)),
    "cylinder": Cylinder(0.08, 0.1),
    "sphere": Sphere(0.07),
}
COORDINATE = st.floats(-0.2, 0.2)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)
any_solid = pytest.mark.parametrize("solid", SOLIDS.values(), ids=SOLIDS)


def one(solid, point):
    found = solid.distance(np.array([point]))
    return found.distance_m[0], found.point_m[0], found.normal[0]


def surface_points(solid, count=20_000):
    """Points spread over the whole surface, by projecting a cloud radially onto it."""
    rng = np.random.default_rng(0)
    inner, outer = np.zeros((count, 3)), 2 * solid.reach_m * unit(rng.normal(size=(count, 3)))
    for _ in range(40):
        middle = 0.5 * (inner + outer)
        inside = (solid.distance(middle).distance_m < 0.0)[:, None]
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    return outer


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@any_solid
@settings(deadline=None)
@given(point=POINT)
def test_the_nearest_point_is_on_the_surface_at_that_distance(solid, point):
    distance, nearest, normal = one(solid, point)
    assert abs(one(solid, nearest)[0]) < 1e-12
    assert np.linalg.norm(np.array(point) - nearest) == pytest.approx(abs(distance), abs=1e-12)
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    # Along the normal one gets from the surface to the point.
    np.testing.assert_allclose(nearest + distance * normal, point, atol=1e-12)


@any_solid
@settings(deadline=None)
@given(a=POINT, b=POINT)
def test_no_distance_changes_faster_than_the_point_moves(solid, a, b):
    gap = float(np.linalg.norm(np.array(a) - np.array(b)))
    assert abs(one(solid, a)[0] - one(solid, b)[0]) <= gap + 1e-12


@any_solid
def test_the_gradient_is_the_normal_and_one_long(solid):
    points = np.random.default_rng(1).uniform(-0.15, 0.15, (2000, 3))
    found, step = solid.distance(points), 1e-7
    gradient = np.stack(
        [
            (solid.distance(points + step * axis).distance_m - found.distance_m) / step
            for axis in np.eye(3)
        ],
        axis=1,
    )
    # Where two faces are equally near the gradient jumps: of random points a few are so close.
    agrees = np.linalg.norm(gradient - found.normal, axis=1) < 1e-4
    assert agrees.mean() > 0.995


@any_solid
def test_brute_force_over_the_surface_finds_nothing_nearer(solid):
    cloud = surface_points(solid)
    for point in np.random.default_rng(2).uniform(-0.12, 0.12, (40, 3)):
        brute_m = np.linalg.norm(cloud - point, axis=1).min()
        # The cloud has a point within 2 mm of every place.
        assert brute_m - 2e-3 <= abs(one(solid, point)[0]) <= brute_m + 1e-9


def test_insides_are_negative_and_as_deep_as_the_nearest_face():
    assert one(SOLIDS["box"], (0.0, 0.0, 0.01))[0] == pytest.approx(-0.005)
    assert one(SOLIDS["cylinder"], (0.03, 0.0, 0.0))[0] == pytest.approx(-0.01)
    assert one(SOLIDS["cylinder"], (0.0, 0.045, 0.0))[0] == pytest.approx(-0.005)
    assert one(SOLIDS["sphere"], (0.0, 0.0, 0.0))[0] == pytest.approx(-0.035)


@any_solid
def test_reach_is_the_farthest_surface(solid):
    farthest = np.linalg.norm(surface_points(solid), axis=1).max()
    assert farthest <= solid.reach_m + 1e-9
    assert farthest > solid.reach_m - 4e-3


@any_solid
def test_a_capsules_distance_is_that_of_all_its_balls(solid):
    rng = np.random.default_rng(3)
    starts = rng.uniform(-0.08, 0.08, (400, 3))
    ends = np.stack([starts, starts + 0.02 * unit(rng.normal(size=(400, 3)))], axis=1)
    radii = np.tile([0.0078, 0.0068], (400, 1))
    shares = np.linspace(0.0, 1.0, 401)
    every = [
        solid.distance(ends[:, 0] + s * (ends[:, 1] - ends[:, 0])).distance_m
        - (radii[:, 0] + s * (radii[:, 1] - radii[:, 0]))
        for s in shares
    ]
    found, brute = capsule_distance(solid, ends, radii), np.min(every, axis=0)
    near = brute > -0.005
    assert near.sum() > 200
    np.testing.assert_allclose(found.distance_m[near], brute[near], atol=5e-6)
    np.testing.assert_allclose(solid.distance(found.point_m).distance_m, 0.0, atol=1e-12)
