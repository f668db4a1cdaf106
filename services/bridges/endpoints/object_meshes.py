"""Meshes of objects as GLB files in metres, for programs that draw them."""

from __future__ import annotations

import logging
from pathlib import Path

from rhot.errors import RhotError
from rhot.files.config import RigConfig
from rhot.files.shapes import read_triangles

log = logging.getLogger("rhot.bridge")


def object_meshes(config: RigConfig) -> dict[str, bytes]:
    """The GLB of each object whose shape is a mesh; one that cannot be read is a warning.

    Files are written anew, from triangles alone: what else a foreign file holds goes nowhere.
    """
    found: dict[str, bytes] = {}
    for table in config.object:
        if table.shape != "mesh":
            continue
        try:
            found[table.name] = _glb(Path(config.folder) / table.mesh)
        except RhotError as error:
            log.warning("object %s is shown as a ball: %s", table.name, error)
    return found


def _glb(path: Path) -> bytes:
    vertices_m, faces = read_triangles(path)
    import trimesh

    scene = trimesh.Trimesh(vertices_m, faces, process=False).scene()
    return trimesh.exchange.gltf.export_glb(scene)
