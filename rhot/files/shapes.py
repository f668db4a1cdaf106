"""An object's shape as rig.toml says it: a solid to measure distances to.

Meshes are read by trimesh, which comes with the viewer (viser); nothing else needs it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError, ConfigError
from rhot.files.rig_tables import ObjectTable
from rhot.files.table_rules import shape_problem
from rhot.geometry.solids import Box, Cylinder, Solid, Sphere
from rhot.geometry.transforms import Array

# A ball of 200 000 triangles took 2.5 s and 250 MB to read on a PC, and 7 ms for the distances of
# the 216 points of a hand. More is a mistake.
_MAX_TRIANGLES = 200_000
# What a hand can touch is no larger; a file in millimetres, read as metres, is.
_MAX_REACH_M = 10.0
_MESH_FILES = (".glb", ".stl")


def solid_of(table: ObjectTable, folder: Path) -> Solid | None:
    """The solid of an [[object]] table, None if it has no shape; folder is rig.toml's.

    Raises ConfigError if shape, size_m and mesh do not fit, CalibrationError if the mesh file
    cannot be used.
    """
    wrong = shape_problem(table)
    if wrong:
        raise ConfigError(f"[[object]] {table.name!r}: {wrong}")
    if table.shape == "mesh":
        return load_mesh(folder / table.mesh)
    if table.shape == "box":
        x, y, z = table.size_m
        return Box((x, y, z))
    if table.shape == "cylinder":
        return Cylinder(*table.size_m)
    return Sphere(table.size_m[0]) if table.shape == "sphere" else None


def load_mesh(path: Path) -> Solid:
    """A GLB or STL file, its numbers as metres; all parts of a GLB scene together.

    Raises CalibrationError saying what is wrong with the file, and what to do.
    """
    vertices_m, faces = read_triangles(path)
    from rhot.geometry.meshes import Mesh

    try:
        return Mesh(vertices_m, faces)
    except ValueError as error:
        raise CalibrationError(f"{path}: {error}; export it again") from None


def read_triangles(path: Path) -> tuple[Array, npt.NDArray[np.int64]]:
    """Vertices (v, 3) in metres and faces (f, 3) of a GLB or STL file, for who draws them.

    Raises as load_mesh does.
    """
    if path.suffix.lower() not in _MESH_FILES:
        raise CalibrationError(f"{path}: is no {' or '.join(_MESH_FILES)} file; export one")
    if not path.is_file():
        raise CalibrationError(f"{path}: no such file; `mesh` is relative to rig.toml")
    try:
        import trimesh
    except ImportError as error:
        raise ConfigError(
            f"{path}: a mesh needs {error.name}: install rhot[master], or use a box, a cylinder or "
            "a sphere"
        ) from None
    try:
        # Faces as they are in the file: nothing repaired, nothing left out.
        read = trimesh.load_scene(path, process=False).to_mesh()
    except Exception as error:  # whatever a reader of foreign files may raise
        raise CalibrationError(
            f"{path}: cannot be read as a mesh: {error or type(error).__name__}; export it again"
        ) from None
    faces = len(read.faces)
    if not 0 < faces <= _MAX_TRIANGLES:
        raise CalibrationError(
            f"{path}: has {faces} triangles; 1 to {_MAX_TRIANGLES} can be used. Simplify it"
        )
    vertices_m, triangles = (
        np.asarray(read.vertices, dtype=np.float64),
        np.asarray(read.faces, np.int64),
    )
    reach_m = float(np.linalg.norm(vertices_m[np.unique(triangles)], axis=1).max())
    if reach_m > _MAX_REACH_M:
        raise CalibrationError(
            f"{path}: reaches {reach_m:.0f} m from its origin; its unit must be the metre. "
            "Export it in metres"
        )
    return vertices_m, triangles
