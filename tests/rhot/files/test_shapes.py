"""Shapes of rig.toml: primitives, and real mesh files."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from rhot.errors import CalibrationError, ConfigError
from rhot.files.rig_tables import ObjectTable
from rhot.files.shapes import load_mesh, solid_of
from rhot.geometry.solids import Box, Cylinder, Sphere


def table(**fields):
    return ObjectTable(name="cup", serial="LHR-1", **fields)


def test_primitives(tmp_path):
    assert solid_of(table(), tmp_path) is None
    box = table(shape="box", size_m=(0.1, 0.2, 0.3))
    assert solid_of(box, tmp_path) == Box((0.1, 0.2, 0.3))
    cylinder = table(shape="cylinder", size_m=(0.08, 0.1))
    assert solid_of(cylinder, tmp_path) == Cylinder(0.08, 0.1)
    assert solid_of(table(shape="sphere", size_m=(0.07,)), tmp_path) == Sphere(0.07)


def test_a_shape_that_does_not_fit_its_sizes_is_told(tmp_path):
    with pytest.raises(ConfigError, match=r"'cup'.*size_m has 1 lengths.*diameter, height"):
        solid_of(table(shape="cylinder", size_m=(0.08,)), tmp_path)


@pytest.mark.parametrize("ending", ["glb", "stl", "STL"])
def test_mesh_files_beside_rig_toml(tmp_path, ending):
    (tmp_path / "meshes").mkdir()
    trimesh.creation.cylinder(0.04, 0.1, sections=64).export(tmp_path / "meshes" / f"cup.{ending}")
    solid = solid_of(table(shape="mesh", mesh=f"meshes/cup.{ending}"), tmp_path)
    assert solid is not None
    assert solid.signed
    found = solid.distance(np.array([[0.1, 0.0, 0.0], [0.0, 0.0, 0.06], [0.0, 0.0, 0.0]]))
    # trimesh's cylinder stands along z; its 64 sides are flat, 0.05 mm inside the round one.
    np.testing.assert_allclose(found.distance_m, [0.06, 0.01, -0.04], atol=1e-4)


def test_the_parts_of_a_glb_scene_stand_where_they_are_put(tmp_path):
    scene = trimesh.Scene()
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.02)
    for x in (-0.1, 0.1):
        T = np.eye(4)
        T[0, 3] = x
        scene.add_geometry(ball, transform=T)
    scene.export(tmp_path / "two.glb")
    found = load_mesh(tmp_path / "two.glb").distance(np.array([[0.0, 0, 0], [0.1, 0, 0]]))
    np.testing.assert_allclose(found.distance_m, [0.08, -0.02], atol=3e-4)


def test_files_that_are_no_mesh_are_told(tmp_path):
    with pytest.raises(CalibrationError, match=r"none\.glb: no such file; .*relative to rig.toml"):
        load_mesh(tmp_path / "none.glb")
    (tmp_path / "cup.obj").touch()
    with pytest.raises(CalibrationError, match=r"is no \.glb or \.stl file"):
        load_mesh(tmp_path / "cup.obj")
    for content in (b"", b"glTF\x02\x00\x00\x00 nonsense", b"\xff" * 300, b"{}" * 100):
        for ending in ("glb", "stl"):
            broken = tmp_path / f"broken.{ending}"
            broken.write_bytes(content)
            with pytest.raises(CalibrationError, match=rf"broken\.{ending}: "):
                load_mesh(broken)


def test_a_mesh_in_millimetres_is_told(tmp_path):
    trimesh.creation.icosphere(radius=40.0).export(tmp_path / "mm.stl")
    with pytest.raises(CalibrationError, match="its unit must be the metre"):
        load_mesh(tmp_path / "mm.stl")


def test_a_mesh_that_is_too_fine_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("rhot.files.shapes._MAX_TRIANGLES", 100)
    trimesh.creation.icosphere(subdivisions=2, radius=0.04).export(tmp_path / "fine.stl")
    with pytest.raises(CalibrationError, match=r"has 320 triangles; 1 to 100"):
        load_mesh(tmp_path / "fine.stl")
