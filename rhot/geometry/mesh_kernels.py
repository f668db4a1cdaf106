"""The nearest point of a triangle mesh: a tree of boxes, searched by compiled kernels. Pure.

A node is a box about triangles; leaves hold a few. The search keeps a stack of nodes that may be
nearer than the best so far.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array

Ints = npt.NDArray[np.int64]
Point = tuple[float, float, float]

# Triangles of a leaf: 2, 4 and 8 differ by less than a fifth in time.
_LEAF = 4
# The tree halves at each level: 64 levels hold more triangles than any memory.
_DEPTH = 64


class BoxTree(NamedTuple):
    """n nodes over f triangles."""

    corners: Array  # (f, 3, 3) corners of each triangle, in the order of the leaves
    order: Ints  # (f,) the triangle each of them is
    boxes: Array  # (n, 2, 3) low and high corner
    # (n, 3): of a leaf its first triangle, their count and 0; else 0, 0 and the second child. The
    # first child is the next node.
    nodes: Ints


def build_tree(corners: Array) -> BoxTree:
    """The tree of triangles (f, 3, 3), f > 0."""
    order = np.arange(len(corners))
    boxes = np.empty((2 * len(corners), 2, 3))
    nodes = np.zeros((2 * len(corners), 3), dtype=np.int64)
    count = _split(corners, corners.mean(axis=1), order, boxes, nodes)
    return BoxTree(
        np.ascontiguousarray(corners[order]), order, boxes[:count].copy(), nodes[:count].copy()
    )


@njit(cache=True, nogil=True)
def _split(corners: Array, middles: Array, order: Ints, boxes: Array, nodes: Ints) -> int:
    """Fill order, boxes and nodes; the count of nodes. Halved at the median of the longest side."""
    stack = np.empty((_DEPTH, 3), np.int64)  # first and last triangle, node it is second child of
    stack[0] = 0, len(corners), -1
    height, count = 1, 0
    while height:
        height -= 1
        first, last, parent = stack[height]
        if parent >= 0:
            nodes[parent, 2] = count
        rows = order[first:last]
        low, high = middles[rows[0]].copy(), middles[rows[0]].copy()
        boxes[count, 0], boxes[count, 1] = np.inf, -np.inf
        for row in rows:
            for axis in range(3):
                low[axis] = min(low[axis], middles[row, axis])
                high[axis] = max(high[axis], middles[row, axis])
                for k in range(3):
                    boxes[count, 0, axis] = min(boxes[count, 0, axis], corners[row, k, axis])
                    boxes[count, 1, axis] = max(boxes[count, 1, axis], corners[row, k, axis])
        if last - first <= _LEAF:
            nodes[count, 0], nodes[count, 1] = first, last - first
        else:
            axis = int(np.argmax(high - low))
            order[first:last] = rows[np.argsort(middles[rows, axis])]
            half = first + (last - first) // 2
            # The first child comes next: it is put on the stack last.
            stack[height] = half, last, count
            stack[height + 1] = first, half, -1
            height += 2
        count += 1
    return count


@njit(cache=True, nogil=True)
def nearest_points(tree: BoxTree, points: Array) -> tuple[Array, Ints, Ints]:
    """Of points (n, 3): nearest point (n, 3), its triangle (n,), and the part of it (n,).

    Parts: 0..2 a corner, 3..5 the edge after that corner, 6 the face.
    """
    nearest = np.empty_like(points)
    triangle = np.empty(len(points), np.int64)
    part = np.empty(len(points), np.int64)
    stack = np.empty(_DEPTH, np.int64)
    for n in range(len(points)):
        p = (points[n, 0], points[n, 1], points[n, 2])
        best = np.inf
        stack[0], height = 0, 1
        while height:
            height -= 1
            node = stack[height]
            if _box_distance(tree.boxes, node, p) >= best:
                continue
            first, count, second = tree.nodes[node]
            for k in range(first, first + count):
                found, kind = _on_triangle(tree.corners, k, p)
                away = _minus(found, p)
                square = _dot(away, away)
                if square < best:
                    best = square
                    nearest[n, 0], nearest[n, 1], nearest[n, 2] = found
                    triangle[n], part[n] = tree.order[k], kind
            if count == 0:
                # The nearer child is looked at first: it is put on the stack last.
                near, far = node + 1, second
                if _box_distance(tree.boxes, far, p) < _box_distance(tree.boxes, near, p):
                    near, far = far, near
                stack[height], stack[height + 1] = far, near
                height += 2
    return nearest, triangle, part


@njit(cache=True, nogil=True)
def _box_distance(boxes: Array, node: int, p: Point) -> float:
    """The square of the distance from a node's box to p."""
    square = 0.0
    for axis in range(3):
        beyond = max(boxes[node, 0, axis] - p[axis], p[axis] - boxes[node, 1, axis], 0.0)
        square += beyond * beyond
    return square


@njit(cache=True, nogil=True)
def _on_triangle(corners: Array, k: int, p: Point) -> tuple[Point, int]:
    """The nearest point of triangle k to p, and the part it is on.

    Voronoi regions of the triangle: Ericson, Real-Time Collision Detection (2005), 5.1.5.
    """
    a = (corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2])
    b = (corners[k, 1, 0], corners[k, 1, 1], corners[k, 1, 2])
    c = (corners[k, 2, 0], corners[k, 2, 1], corners[k, 2, 2])
    ab, ac, ap = _minus(b, a), _minus(c, a), _minus(p, a)
    d1, d2 = _dot(ab, ap), _dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a, 0
    bp = _minus(p, b)
    d3, d4 = _dot(ab, bp), _dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b, 1
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return _along(a, d1 / (d1 - d3), ab), 3
    cp = _minus(p, c)
    d5, d6 = _dot(ab, cp), _dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c, 2
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return _along(a, d2 / (d2 - d6), ac), 5
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        return _along(b, (d4 - d3) / ((d4 - d3) + (d5 - d6)), _minus(c, b)), 4
    total = 1.0 / (va + vb + vc)
    return _along(_along(a, vb * total, ab), vc * total, ac), 6


@njit(cache=True, nogil=True)
def _dot(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True)
def _minus(a: Point, b: Point) -> Point:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit(cache=True, nogil=True)
def _along(start: Point, share: float, way: Point) -> Point:
    return (start[0] + share * way[0], start[1] + share * way[1], start[2] + share * way[2])
