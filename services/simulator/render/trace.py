"""Tracing a picture row by row, each at its own instant (rolling shutter), with one ray a pixel.

Compiled kernels. Pure.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from services.simulator.hands.bodies import CAPSULE, Ints
from services.simulator.render.buffers import FrameBuffers, FrameTiming, SceneArrays
from services.simulator.render.motion_paths import dabs_at, find_columns
from services.simulator.render.projection import Array32
from services.simulator.render.ray_capsule import (
    FAR,
    PLACED,
    NearestHits,
    intersect_row,
    place_capsule,
    write_attributes,
)
from services.simulator.render.ray_solid import intersect_solid_row, place_solid
from services.simulator.render.shade import Hits, identify, shade


@njit(cache=True, nogil=True, error_model="numpy")
def trace(scene: SceneArrays, buffers: FrameBuffers, timing: FrameTiming) -> None:
    """Fill depth, capsule, label, columns and light with one ray through each pixel."""
    capsules, dabs, surfaces = scene.capsules, scene.dabs, scene.surfaces
    height, width = buffers.depth.shape
    count = capsules.ends.shape[0]
    g = np.zeros((1, count, PLACED))
    write_attributes(capsules.palms, capsules.kind, capsules.end_m, g)
    dab_centres = np.empty((1, dabs.paths.shape[0], 3))
    nearest = NearestHits(np.empty(width), np.empty(width), np.empty(width, np.int64))
    hits = empty_hits(width)
    columns = np.empty(width, np.int64)
    for row in range(height):
        u = timing.first_row + row * timing.row_step
        first, last = width, -1
        nearest.distance[:] = FAR
        for c in range(count):
            if row < capsules.rows[c, 0] or row > capsules.rows[c, 1]:
                continue
            x0, x1 = find_columns(capsules.tracks[c], u, row, width)
            if x1 < x0:
                continue
            place_capsule(capsules.ends[c], capsules.radius[c], u, g[0, c])
            if capsules.kind[c, 3] == CAPSULE:
                intersect_row(g[0, c], buffers.rays[row], x0, x1, c, nearest)
            else:
                place_solid(capsules.kind[c, 3], capsules.half[c], capsules.palms[c], u, g[0, c])
                part = buffers.rays[row], x0, x1
                intersect_solid_row(part, g[0, c], c, scene.meshes, nearest)
            first, last = min(first, x0), max(last, x1)
        buffers.columns[row, 0], buffers.columns[row, 1] = first, last
        if last >= first:
            n = _collect(buffers.rays[row], first, last, nearest, hits, columns)
            dabs_at(dabs, u, dab_centres[0])
            identify(n, hits, g[0], dab_centres, dabs.radius_squared, dabs.surface)
            shade(n, hits, g[0], surfaces)
            _store(n, hits, columns, row, buffers)


@njit(cache=True, nogil=True, error_model="numpy")
def empty_hits(n: int) -> Hits:
    """Room for n hits."""
    return Hits(
        np.empty(n),
        np.empty(n),
        np.empty((3, n)),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty((3, n)),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _collect(
    rays: Array32, first: int, last: int, nearest: NearestHits, hits: Hits, columns: Ints
) -> int:
    """Gather the pixels of a row that hit something, and their columns; returns how many."""
    n = 0
    for x in range(first, last + 1):
        if nearest.distance[x] < FAR:
            hits.distance[n], hits.along[n] = nearest.distance[x], nearest.along[x]
            for i in range(3):
                hits.ray[i, n] = rays[i, x]
            hits.capsule[n], columns[n] = nearest.capsule[x], x
            n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _store(n: int, hits: Hits, columns: Ints, row: int, buffers: FrameBuffers) -> None:
    """Write n shaded hits into their pixels of a row."""
    for i in range(n):
        x = columns[i]
        buffers.depth[row, x] = hits.distance[i]
        buffers.capsule[row, x] = hits.capsule[i]
        buffers.label[row, x] = 1 + hits.surface[i]
        for j in range(3):
            buffers.light[row, x, j] = hits.rgb[j, i] * buffers.vignette[row, x]
