"""Intersection of rays with cylinders, boxes and meshes, in the frame of one camera. Compiled
kernels. Pure.

A solid shares the table of capsules (ray_capsule.py): a capsule that holds all of it says which
rows and columns it can touch, and the capsule's axis is an axis of the solid. Of a cylinder with
flat ends it is the axis itself; a box and a mesh begin at the capsule's first end, and are turned
by the body's y axis.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import BOX, CYLINDER, MESH
from services.simulator.render.projection import Array32
from services.simulator.render.ray_capsule import (
    AXIS,
    END_A,
    FAR,
    INVERSE_LENGTH,
    LENGTH,
    RADIUS_A,
    NearestHits,
)
from services.simulator.scene.object_bodies import Meshes

# Further fields of a placed capsule: which solid it is, its second and third axis (xyz each), and
# half its width along these, and where the camera is in its frame (xyz).
SHAPE, ACROSS, THIRD, HALF_ACROSS, HALF_THIRD, ORIGIN = 28, 29, 32, 35, 36, 37
# Faces, in the place of a capsule's `along`: the mantle of a cylinder, the six sides of a box (low
# and high end of each axis; the first two are the cylinder's discs), and the triangles of meshes.
MANTLE, FIRST_SIDE, FIRST_TRIANGLE = 0, 1, 7
# A ray this flat to an axis does not meet the planes across it.
_PARALLEL = 1e-12
# The trees of meshes halve at each level.
_DEPTH = 64


@njit(cache=True, nogil=True, error_model="numpy")
def place_solid(shape: int, half: Array, palm: Array, u: float, g: Array) -> None:
    """What a solid needs beside `place_capsule` at instant u; g as there.

    half (2,) m; palm (3, 3) is the parabola of the body's -y.
    """
    g[SHAPE] = shape
    g[HALF_ACROSS], g[HALF_THIRD] = half[0], half[1]
    inverse = g[INVERSE_LENGTH]
    along, squared = 0.0, 0.0
    for i in range(3):
        g[ACROSS + i] = -(palm[0, i] + u * (palm[1, i] + u * palm[2, i]))
        along += g[ACROSS + i] * g[AXIS + i] * inverse
    for i in range(3):
        g[ACROSS + i] -= along * g[AXIS + i] * inverse
        squared += g[ACROSS + i] * g[ACROSS + i]
    scale = 1.0 / math.sqrt(max(squared, 1e-30))
    for i in range(3):
        g[ACROSS + i] *= scale
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        g[THIRD + i] = (g[AXIS + j] * g[ACROSS + k] - g[AXIS + k] * g[ACROSS + j]) * inverse
    ax, ay, az = _local(g, g[END_A], g[END_A + 1], g[END_A + 2])
    g[ORIGIN], g[ORIGIN + 1], g[ORIGIN + 2] = -ax, -ay, -az


@njit(cache=True, nogil=True, error_model="numpy")
def intersect_solid(g: Array, x: float, y: float, z: float, meshes: Meshes) -> tuple[float, float]:
    """(distance, face) of the first point where a unit ray from the origin meets a solid.

    distance is FAR if there is none.
    """
    if g[SHAPE] == CYLINDER:
        return intersect_cylinder(g, x, y, z)
    if g[SHAPE] == BOX:
        return _box(g, x, y, z)
    root = meshes.roots[int(g[SHAPE]) - MESH]
    o, d = np.empty(3), np.empty(3)
    o[0], o[1], o[2] = g[ORIGIN], g[ORIGIN + 1], g[ORIGIN + 2]
    d[0], d[1], d[2] = _local(g, x, y, z)
    return _mesh(meshes, root, o, d)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _local(g: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A direction of the camera's frame, in the solid's."""
    return (
        (g[AXIS] * x + g[AXIS + 1] * y + g[AXIS + 2] * z) * g[INVERSE_LENGTH],
        g[ACROSS] * x + g[ACROSS + 1] * y + g[ACROSS + 2] * z,
        g[THIRD] * x + g[THIRD + 1] * y + g[THIRD + 2] * z,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def intersect_cylinder(g: Array, x: float, y: float, z: float) -> tuple[float, float]:
    """`intersect_solid` of a cylinder."""
    inverse, length, radius = g[INVERSE_LENGTH], g[LENGTH], g[RADIUS_A]
    ax, ay, az = g[END_A], g[END_A + 1], g[END_A + 2]
    ux, uy, uz = g[AXIS] * inverse, g[AXIS + 1] * inverse, g[AXIS + 2] * inverse
    # Along the axis: where the ray begins, and how fast it goes; then the same across it.
    begin = -(ax * ux + ay * uy + az * uz)
    speed = x * ux + y * uy + z * uz
    a = 1.0 - speed * speed
    b = -(ax * x + ay * y + az * z) - begin * speed
    c = ax * ax + ay * ay + az * az - begin * begin - radius * radius
    h = b * b - a * c
    if h < 0.0:
        return FAR, 0.0
    if a > _PARALLEL:
        t = -(b + math.sqrt(h)) / a
        height = begin + t * speed
        if height >= 0.0 and height <= length:
            return (t, float(MANTLE)) if t > 0.0 else (FAR, 0.0)
        if (height < 0.0) != (speed > 0.0):
            return FAR, 0.0
    low = speed > 0.0
    t = ((0.0 if low else length) - begin) / speed
    if t <= 0.0 or a * t * t + 2.0 * b * t + c > 0.0:
        return FAR, 0.0
    return t, float(FIRST_SIDE if low else FIRST_SIDE + 1)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _box(g: Array, x: float, y: float, z: float) -> tuple[float, float]:
    o, d = (g[ORIGIN], g[ORIGIN + 1], g[ORIGIN + 2]), _local(g, x, y, z)
    enter, leave, face = -FAR, FAR, 0
    for i in range(3):
        half = g[HALF_ACROSS] if i == 1 else g[HALF_THIRD]
        low = 0.0 if i == 0 else -half
        high = g[LENGTH] if i == 0 else half
        if abs(d[i]) < _PARALLEL:
            if o[i] < low or o[i] > high:
                return FAR, 0.0
            continue
        forward = d[i] > 0.0
        near = ((low if forward else high) - o[i]) / d[i]
        far = ((high if forward else low) - o[i]) / d[i]
        if near > enter:
            enter, face = near, FIRST_SIDE + 2 * i + (0 if forward else 1)
        leave = min(leave, far)
    if enter > leave or enter <= 0.0:
        return FAR, 0.0
    return enter, float(face)


@njit(cache=True, nogil=True, error_model="numpy")
def _mesh(meshes: Meshes, root: int, o: Array, d: Array) -> tuple[float, float]:
    """The nearest of a mesh's triangles along a ray from o, both in the mesh's frame."""
    stack = np.empty(_DEPTH, np.int64)
    stack[0] = root
    waiting, nearest, face = 1, FAR, 0
    while waiting:
        waiting -= 1
        node = stack[waiting]
        if _box_entry(meshes.boxes[node], o, d) >= nearest:
            continue
        first, count, second = meshes.nodes[node]
        if count:
            for f in range(first, first + count):
                t = _triangle(meshes.corners[f], o, d)
                if t < nearest:
                    nearest, face = t, FIRST_TRIANGLE + f
        else:
            stack[waiting] = second
            stack[waiting + 1] = node + 1
            waiting += 2
    return nearest, float(face)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _box_entry(box: Array, o: Array, d: Array) -> float:
    """Where a ray enters a box, FAR if it misses it."""
    enter, leave = 0.0, FAR
    for i in range(3):
        if abs(d[i]) < _PARALLEL:
            if o[i] < box[0, i] or o[i] > box[1, i]:
                return FAR
            continue
        p, q = (box[0, i] - o[i]) / d[i], (box[1, i] - o[i]) / d[i]
        enter, leave = max(enter, min(p, q)), min(leave, max(p, q))
    return enter if enter <= leave else FAR


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _triangle(corners: Array, o: Array, d: Array) -> float:
    """Moeller & Trumbore, J. Graphics Tools 2(1), 1997; from both sides, FAR if missed."""
    ax, ay, az = corners[0]
    ex, ey, ez = corners[1, 0] - ax, corners[1, 1] - ay, corners[1, 2] - az
    fx, fy, fz = corners[2, 0] - ax, corners[2, 1] - ay, corners[2, 2] - az
    px, py, pz = d[1] * fz - d[2] * fy, d[2] * fx - d[0] * fz, d[0] * fy - d[1] * fx
    volume = ex * px + ey * py + ez * pz
    if abs(volume) < 1e-18:
        return FAR
    sx, sy, sz = o[0] - ax, o[1] - ay, o[2] - az
    v = (sx * px + sy * py + sz * pz) / volume
    qx, qy, qz = sy * ez - sz * ey, sz * ex - sx * ez, sx * ey - sy * ex
    w = (d[0] * qx + d[1] * qy + d[2] * qz) / volume
    t = (fx * qx + fy * qy + fz * qz) / volume
    if v < 0.0 or w < 0.0 or v + w > 1.0 or t <= 0.0:
        return FAR
    return t


@njit(cache=True, nogil=True, error_model="numpy")
def intersect_solid_row(
    row: tuple[Array32, int, int], g: Array, capsule: int, meshes: Meshes, nearest: NearestHits
) -> None:
    """`intersect_solid` for a row's rays (3, w) in its columns first..last, keeping the nearest."""
    rays, first, last = row
    depth, along, owner = nearest.distance, nearest.along, nearest.capsule
    # A kernel that gets the meshes with every ray is three times as slow.
    cylinder = g[SHAPE] == CYLINDER
    for i in range(first, last + 1):
        x, y, z = float(rays[0, i]), float(rays[1, i]), float(rays[2, i])
        t, face = (
            intersect_cylinder(g, x, y, z) if cylinder else intersect_solid(g, x, y, z, meshes)
        )
        if t < depth[i]:
            depth[i], along[i], owner[i] = t, face, capsule


@njit(cache=True, nogil=True, error_model="numpy")
def solid_normal(
    g: Array, face: int, at: tuple[float, float, float], normals: Array
) -> tuple[float, float, float]:
    """Unit normal of a placed solid at the point `at` of that face, from the capsule's end a.

    normals (f, 3) are those of the meshes' triangles.
    """
    x, y, z = at
    inverse = g[INVERSE_LENGTH]
    ux, uy, uz = g[AXIS] * inverse, g[AXIS + 1] * inverse, g[AXIS + 2] * inverse
    if face == MANTLE:
        height = x * ux + y * uy + z * uz
        nx, ny, nz = x - height * ux, y - height * uy, z - height * uz
    else:
        a, b, c = 0.0, 0.0, 0.0
        if face >= FIRST_TRIANGLE:
            a, b, c = normals[face - FIRST_TRIANGLE]
        else:
            side = 1.0 if (face - FIRST_SIDE) % 2 else -1.0
            axis = (face - FIRST_SIDE) // 2
            a = side if axis == 0 else 0.0
            b = side if axis == 1 else 0.0
            c = side if axis == 2 else 0.0
        nx = a * ux + b * g[ACROSS] + c * g[THIRD]
        ny = a * uy + b * g[ACROSS + 1] + c * g[THIRD + 1]
        nz = a * uz + b * g[ACROSS + 2] + c * g[THIRD + 2]
    scale = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz + 1e-30)
    return nx * scale, ny * scale, nz * scale
