"""A triangle mesh as a solid: exact distances, and an inside where it has one.

The nearest point is that of the triangles themselves. Its sign comes from the surface's normal
there, on edges and corners the mean of the faces' weighted by their angles (Baerentzen & Aanaes,
IEEE TVCG 11(3), 2005): right for every closed mesh. A mesh with holes, or one that is not
consistently wound, has no inside: it is unsigned, its distances are never negative.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rhot.geometry.mesh_kernels import BoxTree, build_tree, nearest_points
from rhot.geometry.solids import SignedDistance
from rhot.geometry.transforms import Array

Faces = npt.NDArray[np.int64]

# Corners nearer than this are one: files repeat them for each face (STL) or each colour (GLB), as
# float32, which resolves 0.06 um at a metre.
_WELD_M = 1e-6


class Mesh:
    """Triangles, in the object's frame.

    vertices (v, 3) metres, faces (f, 3) of their rows; at least one face with an area.
    """

    def __init__(self, vertices: Array, faces: Faces) -> None:
        """Raises ValueError if no triangle has an area, or a number is not finite."""
        if not np.all(np.isfinite(vertices)):
            raise ValueError("has coordinates that are not finite numbers")
        vertices, faces = _welded(vertices, faces)
        if not len(faces):
            raise ValueError("has no triangle with an area")
        self.signed = _closed(faces)
        if self.signed and _volume(vertices, faces) < 0.0:
            faces = faces[:, ::-1]  # wound inside out
        self.vertices_m, self.faces = vertices, faces
        self.reach_m = float(np.linalg.norm(vertices[np.unique(faces)], axis=1).max())
        self._tree: BoxTree = build_tree(vertices[faces])
        self._normals = _part_normals(vertices, faces)  # (f, 7, 3)

    def distance(self, points_m: Array) -> SignedDistance:
        """Of points (n, 3) in the object's frame."""
        points = np.ascontiguousarray(points_m, dtype=np.float64)
        nearest, triangle, part = nearest_points(self._tree, points)
        away = points - nearest
        length = np.linalg.norm(away, axis=1)
        facing = self._normals[triangle, part]
        side = np.ones(len(points))
        if self.signed:
            side = np.where(np.einsum("nk,nk->n", away, facing) < 0.0, -1.0, 1.0)
        # On the surface itself there is no direction away from it: 1 nm is its rounding.
        apart = length > 1e-9
        straight = (side / np.where(apart, length, 1.0))[:, None] * away
        return SignedDistance(side * length, nearest, np.where(apart[:, None], straight, facing))


def _welded(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    """Corners at one place made one, and triangles without an area left out."""
    _, first, row = np.unique(
        np.round(vertices / _WELD_M).astype(np.int64),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    vertices, faces = vertices[first], row.reshape(-1)[faces]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return vertices, faces[area > 0.0]


def _closed(faces: Faces) -> bool:
    """Whether each edge has exactly two faces, which run along it in opposite directions."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, counts = np.unique(edges, axis=0, return_counts=True)
    back = np.unique(edges[:, ::-1], axis=0)
    return bool(np.all(counts == 1)) and bool(np.array_equal(there, back))


def _volume(vertices: Array, faces: Faces) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("fk,fk->", a, np.cross(b, c))) / 6.0


def _part_normals(vertices: Array, faces: Faces) -> Array:
    """Of each face its three corners, its three edges (after each corner) and itself; (f, 7, 3)."""
    corners = vertices[faces]  # (f, 3, 3)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1)[:, None]
    at_corner = np.zeros_like(vertices)
    count = len(vertices)
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)  # (f, 3, 2)
    low, high = ends.min(axis=2), ends.max(axis=2)
    _, edge = np.unique(low * count + high, return_inverse=True)
    edge = edge.reshape(-1, 3)
    at_edge = np.zeros((int(edge.max()) + 1, 3))
    for k in range(3):
        ahead = corners[:, (k + 1) % 3] - corners[:, k]
        behind = corners[:, (k + 2) % 3] - corners[:, k]
        angle = np.arctan2(
            np.linalg.norm(np.cross(ahead, behind), axis=1), np.einsum("fk,fk->f", ahead, behind)
        )
        np.add.at(at_corner, faces[:, k], angle[:, None] * face)
        np.add.at(at_edge, edge[:, k], face)
    return np.concatenate([_unit(at_corner)[faces], _unit(at_edge)[edge], face[:, None]], axis=1)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
