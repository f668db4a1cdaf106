"""The bodies of objects: their shapes, and the trackers on them, for the renderer. Pure.

An object without a shape is an upright bar with round ends, its tracker a flat disc across it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from rhot.geometry.mesh_kernels import build_tree
from rhot.geometry.meshes import Mesh
from rhot.geometry.solids import Box, Cylinder
from rhot.geometry.transforms import Array, apply
from services.simulator.hands.bodies import MESH, Ints, ShapeBuilder
from services.simulator.scene.actors import SceneObject
from services.simulator.scene.tracker_mounts import (
    BEAD_RADIUS_M,
    PUCK_HEIGHT_M,
    PUCK_RADIUS_M,
    bead_m,
    is_puck,
)

# An object without a shape: half its length, and its radius; of its tracker likewise.
_HALF_LENGTH_M, _RADIUS_M = 0.055, 0.018
_TRACKER_HALF_M, _TRACKER_RADIUS_M = 0.012, 0.024
# A mesh may be flat; the capsule that holds it may not.
_LEAST_M = 5e-4


class Meshes(NamedTuple):
    """The triangles of all meshes, each mesh in a tree of boxes (rhot/geometry/mesh_kernels.py).

    A mesh begins at the middle of the low end of its extent along x.
    """

    roots: Ints  # (m,) first node of each mesh
    boxes: Array  # (n, 2, 3) low and high corner
    nodes: Ints  # (n, 3) of a leaf first triangle, count, 0; else 0, 0, second child
    corners: Array  # (f, 3, 3) m
    normals: Array  # (f, 3)


@dataclass
class MeshBuilder:
    """Collects meshes one at a time."""

    roots: list[int] = field(default_factory=list)
    boxes: list[Array] = field(default_factory=list)
    nodes: list[Ints] = field(default_factory=list)
    corners: list[Array] = field(default_factory=list)

    def add(self, corners: Array) -> int:
        """Add triangles (f, 3, 3); returns the number of the mesh."""
        tree = build_tree(np.ascontiguousarray(corners))
        nodes = tree.nodes.copy()
        leaf = nodes[:, 1] > 0
        nodes[leaf, 0] += sum(len(rows) for rows in self.corners)
        nodes[~leaf, 2] += sum(len(rows) for rows in self.nodes)
        self.roots.append(sum(len(rows) for rows in self.nodes))
        self.boxes.append(tree.boxes)
        self.nodes.append(nodes)
        self.corners.append(tree.corners)
        return len(self.roots) - 1

    def meshes(self) -> Meshes:
        """What was added so far."""
        corners = np.concatenate([np.zeros((0, 3, 3)), *self.corners])
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return Meshes(
            roots=np.array(self.roots, dtype=np.int64),
            boxes=np.concatenate([np.zeros((0, 2, 3)), *self.boxes]),
            nodes=np.concatenate([np.zeros((0, 3), np.int64), *self.nodes]),
            corners=corners,
            normals=normals / np.where(length > 0.0, length, 1.0),
        )


class ObjectSurfaces(NamedTuple):
    """Numbers of the surfaces of one object; bead is -1 if its tracker is not painted."""

    body: int
    tracker: int
    bead: int


def add_object(
    shapes: ShapeBuilder, meshes: MeshBuilder, item: SceneObject, frame: int, look: ObjectSurfaces
) -> None:
    """Add an object with its tracker, fixed to one body frame."""
    _add_body(shapes, meshes, item, frame, look.body)
    T = item.T_object_from_tracker
    if not is_puck(item.table):
        x, y, z = T[:3, 3].tolist()
        shapes.capsule(
            (frame, (x - _TRACKER_HALF_M, y, z), _TRACKER_RADIUS_M),
            (frame, (x + _TRACKER_HALF_M, y, z), _TRACKER_RADIUS_M),
            surface=look.tracker,
        )
        return
    base, top, bead = (
        tuple(apply(T, point).tolist())
        for point in ((0.0, 0.0, 0.0), (0.0, 0.0, PUCK_HEIGHT_M), bead_m(item.place))
    )
    shapes.cylinder(frame, (base, top), PUCK_RADIUS_M, look.tracker)
    if look.bead >= 0:
        shapes.capsule((frame, bead, BEAD_RADIUS_M), (frame, bead, BEAD_RADIUS_M), look.bead)


def _add_body(
    shapes: ShapeBuilder, meshes: MeshBuilder, item: SceneObject, frame: int, surface: int
) -> None:
    solid = item.solid
    if solid is None:
        shapes.capsule(
            (frame, (0.0, -_HALF_LENGTH_M, 0.0), _RADIUS_M),
            (frame, (0.0, _HALF_LENGTH_M, 0.0), _RADIUS_M),
            surface=surface,
        )
    elif isinstance(solid, Cylinder):
        half = 0.5 * solid.height_m
        ends = ((0.0, -half, 0.0), (0.0, half, 0.0))
        shapes.cylinder(frame, ends, 0.5 * solid.diameter_m, surface)
    elif isinstance(solid, Box):
        half_m = 0.5 * np.array(solid.size_m)
        shapes.block(frame, -half_m, half_m, surface)
    elif isinstance(solid, Mesh):
        corners = solid.vertices_m[solid.faces]
        low, high = corners.min(axis=(0, 1)) - _LEAST_M, corners.max(axis=(0, 1)) + _LEAST_M
        start = np.array([low[0], *(0.5 * (low + high))[1:]])
        shapes.block(frame, low, high, surface, MESH + meshes.add(corners - start))
    else:
        middle = (frame, (0.0, 0.0, 0.0), solid.reach_m)
        shapes.capsule(middle, middle, surface)
