"""Meshes of objects, written anew as GLB."""

from __future__ import annotations

import io
import logging
from pathlib import Path

import numpy as np
import pytest
import trimesh

from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from services.bridges.endpoints.object_meshes import object_meshes


def test_a_mesh_is_as_large_as_in_its_file(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "box.stl")
    objects = [
        ObjectTable(name="box", serial="1", shape="mesh", mesh="box.stl"),
        ObjectTable(name="gone", serial="2", shape="mesh", mesh="gone.glb"),
        ObjectTable(name="ball", serial="3", shape="sphere", size_m=(0.1,)),
    ]
    with caplog.at_level(logging.WARNING):
        found = object_meshes(RigConfig(object=objects, folder=str(tmp_path)))
    assert list(found) == ["box"]
    read = trimesh.load_scene(io.BytesIO(found["box"]), file_type="glb").to_mesh()
    np.testing.assert_allclose(read.extents, (0.1, 0.2, 0.3), rtol=1e-6)
    assert "object gone is shown as a ball" in caplog.text
