"""Meshes of objects: real GLB and STL files, and what cannot be drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from rhot.errors import ConfigError
from services.viewer.scene.object_looks import read_mesh


@pytest.mark.parametrize("name", ["cup.glb", "cup.stl", "CUP.STL"])
def test_a_mesh_is_read_in_metres(tmp_path: Path, name: str) -> None:
    trimesh.creation.cylinder(radius=0.035, height=0.1).export(
        tmp_path / name, file_type=name[-3:].lower()
    )
    vertices, faces = read_mesh(tmp_path / name)
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.07, 0.07, 0.1], atol=1e-6)
    assert faces.dtype == np.uint32
    assert faces.max() < len(vertices)


def test_the_parts_of_a_file_are_one_mesh_each_in_its_place(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for x in (0.0, 0.1):
        scene.add_geometry(
            trimesh.creation.box((0.02, 0.02, 0.02)),
            transform=trimesh.transformations.translation_matrix([x, 0.0, 0.0]),
        )
    scene.export(tmp_path / "two.glb")
    vertices, _ = read_mesh(tmp_path / "two.glb")
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.12, 0.02, 0.02], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("cup.obj", b"v 0 0 0", "is no .glb or .stl file"),
        ("cup.glb", b"glTF but not really", "cannot be read as glb"),
        ("cup.stl", b"", "cup.stl"),
        ("cup.glb", b"", "cup.glb"),
        ("cup.stl", b"solid empty\nendsolid\n", "cup.stl"),
        ("cup.stl", bytes(20_000_001), "has 20 MB, at most 20 are drawn"),
    ],
)
def test_what_cannot_be_drawn_is_named(
    tmp_path: Path, name: str, content: bytes, reason: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ConfigError, match=reason):
        read_mesh(tmp_path / name)


def test_a_missing_file_a_folder_and_millimetres(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No such file"):
        read_mesh(tmp_path / "cup.stl")
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(ConfigError, match="directory"):
        read_mesh(tmp_path / "folder.stl")
    trimesh.creation.box((35.0, 35.0, 100.0)).export(tmp_path / "mm.stl")
    with pytest.raises(ConfigError, match="in mm"):
        read_mesh(tmp_path / "mm.stl")


def test_too_many_triangles(tmp_path: Path) -> None:
    trimesh.creation.icosphere(subdivisions=7, radius=0.05).export(tmp_path / "fine.stl")
    with pytest.raises(ConfigError, match="triangles, at most 200000"):
        read_mesh(tmp_path / "fine.stl")
