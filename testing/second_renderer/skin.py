"""One smooth mesh for a hand, bent by weights: contoured once, and moved as the bones do.

A hand at rest with straight, spread fingers is a smooth union of tapered capsules; where its signed
distance is zero is the skin. Each vertex follows the bones near it (linear blend skinning). A
bone's frame turns as little as its direction asks for, so that nothing twists. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from testing.second_renderer.motion import Array, Bones

# Bones: the palm with the forearm is 0, three of each digit follow.
PALM = 0
_VOXEL_M = 0.0016
# How far parts blend into each other.
_BLEND_M = 0.0035
_WEIGHT_M = 0.0022
# Radii at the four joints of each digit, of a hand whose middle finger's first bone is 46 mm long.
_RADII_MM = (
    (13.0, 11.0, 9.6, 8.0),
    (10.5, 9.3, 8.2, 6.9),
    (10.5, 9.5, 8.4, 7.1),
    (10.0, 8.9, 7.9, 6.7),
    (9.0, 7.7, 6.9, 5.8),
)
# The pulp reaches beyond the end of the bone.
_PULP_M = 0.003
# Last phalanges are wider than thick.
_WIDE, _FLAT = 1.04, 0.93
# Directions of straight fingers: towards the thumb, and out of the palm (right hand).
_SPREAD_DEG = ((38.0, 28.0), (9.0, 0.0), (1.0, 0.0), (-8.0, 0.0), (-17.0, 0.0))


class Mesh(NamedTuple):
    """A hand at rest in its wrist's frame, and by what each vertex moves."""

    vertices: Array  # (v, 3)
    normals: Array  # (v, 3)
    faces: np.ndarray  # (f, 3)
    weights: Array  # (v, 16)
    # Where bones begin at rest, and their frames, columns x, y, z with -z along the bone.
    origins: Array  # (16, 3)
    frames: Array  # (16, 3, 3)
    lengths: Array  # (16,)


@dataclass(frozen=True)
class Build:
    """How thick a hand is: share of the radii, and of the palm's thickness."""

    thick: float = 1.0
    palm: float = 1.0


def frame_along(direction: Array, before: Array) -> Array:
    """The frame (3, 3) that has -z along a direction, turned as little as can be from another."""
    a, b = -before[:, 2], direction / np.linalg.norm(direction)
    axis, cosine = np.cross(a, b), float(a @ b)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray((np.eye(3) + k + k @ k / max(1.0 + cosine, 1e-6)) @ before)


def bone_frames(wrist: Array, axes: Array, joints: Array) -> tuple[Array, Array]:
    """Origins (16, 3) and frames (16, 3, 3) of a hand's bones at an instant."""
    origins, frames = np.empty((16, 3)), np.empty((16, 3, 3))
    origins[PALM], frames[PALM] = wrist, axes
    for digit in range(5):
        before = axes
        for k in range(3):
            bone = 1 + 3 * digit + k
            before = frame_along(joints[digit, k + 1] - joints[digit, k], before)
            origins[bone], frames[bone] = joints[digit, k], before
    return origins, frames


def rest_joints(bones: Bones) -> Array:
    """Joints (5, 4, 3) in the wrist's frame of a hand with straight, spread fingers."""
    local = np.einsum("nji,nfkj->nfki", bones.axes, bones.joints - bones.wrist[:, None, None])
    lengths = np.linalg.norm(np.diff(local, axis=2), axis=3).mean(axis=0)  # (5, 3)
    rest = np.empty((5, 4, 3))
    for digit, (aside, out) in enumerate(np.deg2rad(_SPREAD_DEG)):
        way = np.array([-np.sin(aside), -np.sin(out), -np.cos(aside) * np.cos(out)])
        way /= np.linalg.norm(way)
        start = local[:, digit, 0].mean(axis=0)
        rest[digit] = start + np.concatenate([[0.0], np.cumsum(lengths[digit])])[:, None] * way
    return rest


def hand_mesh(bones: Bones, build: Build) -> Mesh:
    """The skin of a hand with these bones."""
    joints = rest_joints(bones)
    origins, frames = bone_frames(np.zeros(3), np.eye(3), joints)
    size = float(np.linalg.norm(joints[2, 1] - joints[2, 0]) / 0.046)
    parts = _parts(joints, frames, size, build)
    low, high = joints.reshape(-1, 3).min(axis=0) - 0.03, joints.reshape(-1, 3).max(axis=0) + 0.03
    low, high = np.minimum(low, [-0.06, -0.06, -0.1]), np.maximum(high, [0.06, 0.06, 0.145])
    vertices, faces = _contour(parts, low, high)
    distances = np.stack([_bone_distance(parts, bone, vertices) for bone in range(16)], axis=1)
    near = distances - distances.min(axis=1, keepdims=True)
    weights = np.exp(-((near / _WEIGHT_M) ** 2))
    weights[weights < 1e-3] = 0.0
    weights /= weights.sum(axis=1, keepdims=True)
    normals = _gradient(parts, vertices)
    lengths = np.zeros(16)
    lengths[1:] = np.linalg.norm(np.diff(joints, axis=1), axis=2).ravel()
    lengths[3::3] += _PULP_M
    return Mesh(vertices, normals, faces, weights, origins, frames, lengths)


class _Part(NamedTuple):
    """A tapered capsule of one bone; squash (3,) shrinks space along the axes of its frame."""

    bone: int
    begin: Array
    end: Array
    radii: tuple[float, float]
    frame: Array
    squash: tuple[float, float]


def _parts(joints: Array, frames: Array, size: float, build: Build) -> list[_Part]:
    parts = []
    for digit in range(5):
        radii = 1e-3 * size * build.thick * np.array(_RADII_MM[digit])
        for k in range(3):
            bone = 1 + 3 * digit + k
            begin, end = joints[digit, k], joints[digit, k + 1]
            if k == 2:
                way = (end - begin) / np.linalg.norm(end - begin)
                end = end + (_PULP_M - radii[3]) * way
            squash = (_WIDE, _FLAT) if k == 2 else (1.0, 1.0)
            parts.append(_Part(bone, begin, end, (radii[k], radii[k + 1]), frames[bone], squash))
    return [*parts, *_palm(joints, size, size * build.palm)]


def _palm(joints: Array, size: float, thick: float) -> list[_Part]:
    """Four rays from the wrist to the knuckles, the ball of the thumb, and a flat forearm."""
    upright, plain = np.eye(3), (1.0, 1.0)
    parts = []
    for digit, x_mm in zip(range(1, 5), (-14.0, -4.0, 6.0, 14.0), strict=True):
        begin = 1e-3 * size * np.array([x_mm, 0.0, -4.0])
        radii = (0.0135 * thick, 0.0118 * thick)
        parts.append(_Part(PALM, begin, joints[digit, 0], radii, upright, plain))
    ball, towards = joints[0, 0] + 1e-3 * size * np.array([4.0, -2.0, 0.0]), 0.55 * joints[1, 0]
    parts.append(_Part(PALM, ball, towards, (0.013 * thick, 0.012 * thick), upright, plain))
    begin, end = np.array([0.0, 0.0, 0.004]), np.array([0.0, 0.0, 0.13])
    radii = (0.0215 * thick, 0.029 * thick)
    parts.append(_Part(PALM, begin, end, radii, upright, (1.28, 0.86)))
    return parts


def _distance(part: _Part, points: Array) -> Array:
    """About the signed distance of points (p, 3) from a part."""
    local = (points - part.begin) @ part.frame
    end = (part.end - part.begin) @ part.frame
    local = local / np.array([*part.squash, 1.0])
    end = end / np.array([*part.squash, 1.0])
    along = np.clip(local @ end / (end @ end), 0.0, 1.0)
    away = np.linalg.norm(local - along[:, None] * end, axis=1)
    return np.asarray(away - (part.radii[0] + along * (part.radii[1] - part.radii[0])))


def _bone_distance(parts: list[_Part], bone: int, points: Array) -> Array:
    return np.asarray(np.min([_distance(p, points) for p in parts if p.bone == bone], axis=0))


def _union(parts: list[_Part], points: Array) -> Array:
    """Smooth union: minus the logarithm of the sum of exponentials."""
    total, nearest = np.zeros(len(points)), np.full(len(points), np.inf)
    distances = [_distance(part, points) for part in parts]
    for one in distances:
        nearest = np.minimum(nearest, one)
    for one in distances:
        total += np.exp(-(one - nearest) / (0.4 * _BLEND_M))
    return np.asarray(nearest - 0.4 * _BLEND_M * np.log(total))


def _gradient(parts: list[_Part], points: Array) -> Array:
    step = 4e-4
    normals = np.stack(
        [
            _union(parts, points + step * axis) - _union(parts, points - step * axis)
            for axis in np.eye(3)
        ],
        axis=1,
    )
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _contour(parts: list[_Part], low: Array, high: Array) -> tuple[Array, np.ndarray]:
    counts = np.ceil((high - low) / _VOXEL_M).astype(int) + 1
    axes = [low[k] + _VOXEL_M * np.arange(counts[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    values = np.concatenate([_union(parts, part) for part in np.array_split(grid, 24)])
    image = vtk.vtkImageData()
    image.SetDimensions(*counts.tolist())
    image.SetOrigin(*low.tolist())
    image.SetSpacing(_VOXEL_M, _VOXEL_M, _VOXEL_M)
    ordered = values.reshape(counts).transpose(2, 1, 0).ravel()
    image.GetPointData().SetScalars(numpy_to_vtk(ordered, deep=True))
    contour = vtk.vtkFlyingEdges3D()
    contour.SetInputData(image)
    contour.SetValue(0, 0.0)
    contour.ComputeNormalsOff()
    contour.Update()
    found = contour.GetOutput()
    vertices = vtk_to_numpy(found.GetPoints().GetData()).astype(np.float64)
    faces = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    # The contour looks inwards, where distances are less.
    return vertices, faces[:, ::-1].copy()


class Skinned:
    """A mesh in motion: where its vertices are, with the bones of some instants."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._used = [np.flatnonzero(mesh.weights[:, bone] > 0.0) for bone in range(16)]

    def pose(self, wrist: Array, axes: Array, joints: Array) -> tuple[Array, Array]:
        """Vertices (v, 3) and normals (v, 3) of a hand whose bones are there."""
        mesh = self.mesh
        origins, frames = bone_frames(wrist, axes, joints)
        vertices, normals = np.zeros_like(mesh.vertices), np.zeros_like(mesh.normals)
        for bone, rows in enumerate(self._used):
            turn = frames[bone] @ mesh.frames[bone].T
            weight = mesh.weights[rows, bone, None]
            moved = (mesh.vertices[rows] - mesh.origins[bone]) @ turn.T + origins[bone]
            vertices[rows] += weight * moved
            normals[rows] += weight * (mesh.normals[rows] @ turn.T)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        return vertices, normals
