"""Distances to meshes: against brute force, and against the solids they are meshes of."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from rhot.geometry.meshes import Mesh
from rhot.geometry.solids import Box


def points(count=400, side_m=0.1):
    return np.random.default_rng(0).uniform(-side_m, side_m, (count, 3))


def mesh_of(made):
    return Mesh(np.array(made.vertices), np.array(made.faces))


def brute(mesh, point):
    """Distance to all triangles: seven candidates of each, those outside of it left out."""
    best = np.inf
    for face in mesh.faces:
        a, b, c = mesh.vertices_m[face]
        for p, q in ((a, b), (b, c), (c, a)):
            along = np.clip((point - p) @ (q - p) / ((q - p) @ (q - p)), 0.0, 1.0)
            best = min(best, np.linalg.norm(p + along * (q - p) - point))
        base = np.stack([b - a, c - a], axis=1)
        u, v = np.linalg.lstsq(base, point - a, rcond=None)[0]
        if u >= 0.0 and v >= 0.0 and u + v <= 1.0:
            best = min(best, np.linalg.norm(a + base @ [u, v] - point))
    return best


@pytest.mark.parametrize(
    "made",
    [
        trimesh.creation.icosphere(subdivisions=1, radius=0.04),
        trimesh.creation.cylinder(0.04, 0.1, sections=12),
        trimesh.creation.annulus(0.03, 0.04, 0.1, sections=12),
        trimesh.creation.torus(0.04, 0.01, major_sections=10, minor_sections=6),
    ],
    ids=["ball", "cylinder", "ring", "torus"],
)
def test_the_nearest_triangle_and_the_right_side_of_it(made):
    mesh, cloud = mesh_of(made), points(40, 0.045)
    found = mesh.distance(cloud)
    assert mesh.signed
    np.testing.assert_allclose(
        np.abs(found.distance_m), [brute(mesh, point) for point in cloud], atol=1e-12
    )
    inside = np.array([winding(mesh, point) > 0.5 for point in cloud])
    assert 2 < inside.sum() < 38
    np.testing.assert_array_equal(found.distance_m < 0.0, inside)
    np.testing.assert_allclose(
        found.point_m + found.distance_m[:, None] * found.normal, cloud, atol=1e-9
    )


def winding(mesh, point):
    """How often the surface goes round a point (van Oosterom & Strackee, 1983)."""
    a, b, c = (mesh.vertices_m[mesh.faces[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    dot = np.einsum
    top = dot("fk,fk->f", a, np.cross(b, c))
    below = (
        la * lb * lc
        + dot("fk,fk->f", a, b) * lc
        + dot("fk,fk->f", b, c) * la
        + dot("fk,fk->f", c, a) * lb
    )
    return np.arctan2(top, below).sum() / (2 * np.pi)


def test_a_boxs_mesh_is_the_box_inside_out_or_not():
    box, cloud = Box((0.06, 0.08, 0.03)), points()
    made = trimesh.creation.box((0.06, 0.08, 0.03))
    expected = box.distance(cloud)
    for faces in (made.faces, made.faces[:, ::-1]):
        found = Mesh(np.array(made.vertices), np.array(faces)).distance(cloud)
        np.testing.assert_allclose(found.distance_m, expected.distance_m, atol=1e-12)
        np.testing.assert_allclose(found.normal, expected.normal, atol=1e-6)


def test_corners_that_are_repeated_for_each_face_are_one():
    made = trimesh.creation.icosphere(subdivisions=2, radius=0.04)
    apart = np.array(made.vertices[made.faces]).reshape(-1, 3)
    mesh = Mesh(apart, np.arange(len(apart)).reshape(-1, 3))
    assert mesh.signed
    assert len(mesh.vertices_m) == len(made.vertices)
    assert mesh.reach_m == pytest.approx(0.04)


@pytest.mark.parametrize("left_out", [slice(1, None), slice(None, -3)])
def test_a_mesh_with_holes_has_no_inside(left_out):
    made = trimesh.creation.icosphere(subdivisions=2, radius=0.04)
    mesh = Mesh(np.array(made.vertices), np.array(made.faces[left_out]))
    found = mesh.distance(np.zeros((1, 3)))
    assert not mesh.signed
    assert 0.03 < found.distance_m[0] <= 0.04
    # Its surface faces who looks at it.
    assert found.normal[0] @ found.point_m[0] < 0.0


def test_a_face_wound_the_other_way_makes_it_unsigned():
    made = trimesh.creation.icosphere(subdivisions=1, radius=0.04)
    faces = np.array(made.faces)
    faces[5] = faces[5, ::-1]
    assert not Mesh(np.array(made.vertices), faces).signed


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        (np.zeros((3, 3)), "no triangle with an area"),
        (np.array([[0.0, 0, 0], [1, 0, 0], [np.nan, 1, 0]]), "not finite"),
    ],
)
def test_what_is_no_surface_is_refused(vertices, words):
    with pytest.raises(ValueError, match=words):
        Mesh(vertices, np.array([[0, 1, 2]]))
