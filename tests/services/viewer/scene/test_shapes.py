"""Meshes and bone geometry."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand import JOINTS
from services.viewer.scene.shapes import (
    BONES,
    cylinders,
    ellipsoids,
    fading_lines,
    unit_cylinder,
    unit_sphere,
)


def test_bones_connect_every_joint_but_the_palm() -> None:
    assert BONES.shape == (27, 2)
    assert set(range(26)) - set(BONES.ravel().tolist()) == {JOINTS.index("palm")}
    names = {(JOINTS[a], JOINTS[b]) for a, b in BONES}
    assert {
        ("wrist", "thumb_metacarpal"),
        ("wrist", "index_metacarpal"),
        ("index_distal", "index_tip"),
    } < names


def test_cylinders_reach_from_start_to_end() -> None:
    rng = np.random.default_rng(0)
    axes = np.vstack([np.eye(3), -np.eye(3)])
    near = np.array([[1e-8, 0, -1.0], [0.0, 1e-4, -1.0], [3e-7, -2e-7, -1.0]])
    along = np.vstack([rng.normal(size=(200, 3)), axes, near])
    start = rng.normal(size=along.shape)
    middle, wxyz, length = cylinders(start, start + along)
    for m, q, size, a, b in zip(middle, wxyz, length, start, start + along, strict=True):
        tip = m + rotation_from_quaternion(q) @ [0.0, 0.0, 0.5 * size]
        np.testing.assert_allclose(tip, b, atol=2e-6)
        np.testing.assert_allclose(2 * m - tip, a, atol=2e-6)
    np.testing.assert_allclose(np.linalg.norm(wxyz, axis=1), 1.0)


def test_a_bone_without_length_is_no_nan() -> None:
    middle, wxyz, length = cylinders(np.ones((1, 3)), np.ones((1, 3)))
    assert length.tolist() == [0.0]
    assert middle.tolist() == [[1.0, 1.0, 1.0]]
    assert wxyz.tolist() == [[1.0, 0.0, 0.0, 0.0]]


def normals(
    mesh: tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    a, b, c = (mesh[0][mesh[1][:, i]] for i in range(3))
    return np.cross(b - a, c - a), (a + b + c) / 3.0


def test_the_sphere_is_closed_and_seen_from_outside() -> None:
    vertices, faces = unit_sphere()
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0)
    edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1].tolist()) == {2}
    normal, middle = normals((vertices, faces))
    assert np.all(np.sum(normal * middle, axis=1) > 0.0)
    # The volume of the polyhedron is near the sphere's.
    assert np.sum(normal * middle) / 6.0 == pytest.approx(4.0 / 3.0 * np.pi, rel=0.06)


def test_the_tube_is_seen_from_outside() -> None:
    vertices, faces = unit_cylinder()
    assert np.abs(vertices[:, 2]).tolist() == [0.5] * len(vertices)
    normal, middle = normals((vertices, faces))
    assert np.all(np.sum(normal[:, :2] * middle[:, :2], axis=1) > 0.0)
    assert len(faces) == len(vertices)


def test_an_ellipsoid_has_nineteen_errors_of_twenty_inside() -> None:
    rng = np.random.default_rng(4)
    root = rng.normal(size=(3, 3)) * 1e-3
    covariance = root @ root.T
    (wxyz,), (axes,) = ellipsoids(covariance[np.triu_indices(3)][None])
    errors = rng.multivariate_normal(np.zeros(3), covariance, 20000)
    inside = np.linalg.norm(errors @ rotation_from_quaternion(wxyz) / axes, axis=1) < 1.0
    assert inside.mean() == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("value", [0.0, -1.0, 1e300, np.nan, np.inf])
def test_a_covariance_that_is_none_is_drawn_finite_and_no_larger_than_a_hand(value: float) -> None:
    wxyz, axes = ellipsoids(np.full((2, 6), value))
    np.testing.assert_allclose(np.linalg.norm(wxyz, axis=1), 1.0)
    assert np.all((axes > 0.0) & (axes <= 0.1))


def test_trails_fade_away_from_the_tip() -> None:
    trail = np.arange(4 * 2 * 3, dtype=float).reshape(4, 2, 3)
    lines_m, colors = fading_lines(trail, (250, 250, 250), (100, 100, 100))
    assert lines_m.shape == colors.shape == (6, 2, 3)
    np.testing.assert_array_equal(lines_m[0], trail[0:2, 0])
    np.testing.assert_array_equal(lines_m[-1], trail[2:4, 1])
    assert colors[0, 0].tolist() == [250] * 3
    assert colors[-1, 1].tolist() == [100] * 3
