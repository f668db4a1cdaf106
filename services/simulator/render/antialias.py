"""Several rays for each pixel that `edges` has flagged, over its area and the exposure: smooth
outlines and motion blur. Compiled kernels. Pure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import CAPSULE, CYLINDER, Ints
from services.simulator.render.buffers import (
    MAX_SAMPLES,
    MIN_SAMPLES,
    CapsulePaths,
    FrameBuffers,
    FrameTiming,
    SceneArrays,
)
from services.simulator.render.edges import STILL_PX
from services.simulator.render.motion_paths import dabs_at, find_columns
from services.simulator.render.projection import Array32
from services.simulator.render.ray_capsule import (
    FAR,
    PLACED,
    intersect,
    place_capsule,
    write_attributes,
)
from services.simulator.render.ray_solid import (
    SHAPE,
    intersect_cylinder,
    intersect_solid,
    place_solid,
)
from services.simulator.render.shade import Hits, identify, shade
from services.simulator.render.trace import empty_hits
from services.simulator.scene.object_bodies import Meshes

# A step of 1.5 px between instants vanishes in the lens blur.
_STEP_PX = 1.5


class RowCapsules(NamedTuple):
    """The capsules that touch a row, at every instant of its exposure."""

    placed: Array  # (instants, c, PLACED) of all capsules; only those of this row are up to date
    active: Ints  # (n,) which ones touch the row
    columns: Ints  # (n, 2) first and last column of each of these
    meshes: Meshes


@njit(cache=True, nogil=True, error_model="numpy")
def supersample(
    scene: SceneArrays, buffers: FrameBuffers, timing: FrameTiming, longest: float, wide: Ints
) -> None:
    """Replace the light of each flagged pixel inside `wide` by the mean of several rays.

    longest is the longest motion of `flag_edges` in px, wide (h, 2) the columns of each row.
    """
    capsules, dabs, surfaces = scene.capsules, scene.dabs, scene.surfaces
    width = buffers.depth.shape[1]
    count = capsules.ends.shape[0]
    instants = 1 if longest <= STILL_PX else _sample_count(longest)
    g = np.zeros((instants, count, PLACED))
    write_attributes(capsules.palms, capsules.kind, capsules.end_m, g)
    flat = g.reshape(instants * count, PLACED)
    room = RowCapsules(g, np.empty(count, np.int64), np.empty((count, 2), np.int64), scene.meshes)
    dab_centres = np.empty((instants, dabs.paths.shape[0], 3))
    hits = empty_hits(MAX_SAMPLES * width)
    pixels = np.empty((width, 3), np.int64)
    for row in range(buffers.depth.shape[0]):
        first, last = wide[row, 0], wide[row, 1]
        if last < first or not np.any(buffers.flags[row, first : last + 1]):
            continue
        u = timing.first_row + row * timing.row_step
        touching = _place_in_row(capsules, row, u, timing.exposure, width, room)
        for k in range(instants):
            dabs_at(dabs, _instant(u, k, instants, timing.exposure), dab_centres[k])
        p, n = _cast_rays(buffers, row, wide[row], touching, hits, pixels)
        identify(n, hits, flat, dab_centres, dabs.radius_squared, dabs.surface)
        shade(n, hits, flat, surfaces)
        _average(p, pixels, hits, row, buffers)


@njit(cache=True, nogil=True, error_model="numpy")
def _sample_count(motion_px: float) -> int:
    """Rays for a pixel whose outline moves so far."""
    return min(MAX_SAMPLES, max(MIN_SAMPLES, int(motion_px / _STEP_PX) + 2))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _instant(u: float, k: int, instants: int, exposure: float) -> float:
    """The middle of the k-th part of the exposure about u."""
    return u + ((k + 0.5) / instants - 0.5) * exposure


@njit(cache=True, nogil=True, error_model="numpy")
def _place_in_row(
    capsules: CapsulePaths, row: int, u: float, exposure: float, width: int, room: RowCapsules
) -> RowCapsules:
    """Place the capsules that touch a row, at every instant, in `room` for all capsules."""
    placed, active, columns = room.placed, room.active, room.columns
    instants = placed.shape[0]
    n = 0
    for c in range(capsules.ends.shape[0]):
        if row < capsules.rows[c, 0] or row > capsules.rows[c, 1]:
            continue
        x0, x1 = find_columns(capsules.tracks[c], u, row, width)
        if instants > 1:
            for k in (-0.5, 0.5):
                p, q = find_columns(capsules.tracks[c], u + k * exposure, row, width)
                if q >= p:
                    x0, x1 = (min(x0, p), max(x1, q)) if x1 >= x0 else (p, q)
        if x1 < x0:
            continue
        active[n], columns[n, 0], columns[n, 1] = c, x0 - 1, x1 + 1
        for k in range(instants):
            at = _instant(u, k, instants, exposure)
            place_capsule(capsules.ends[c], capsules.radius[c], at, placed[k, c])
            if capsules.kind[c, 3] != CAPSULE:
                place_solid(
                    capsules.kind[c, 3], capsules.half[c], capsules.palms[c], at, placed[k, c]
                )
        n += 1
    return RowCapsules(placed, active[:n], columns[:n], room.meshes)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _cast_rays(
    buffers: FrameBuffers, row: int, wide: Ints, touching: RowCapsules, hits: Hits, pixels: Ints
) -> tuple[int, int]:
    """The rays of a row's flagged pixels in the columns wide (2,); returns how many pixels and how
    many hits.

    pixels (p, 3): column, rays cast, rays that hit.
    """
    flags, patterns = buffers.flags[row], buffers.patterns
    placed, active, columns = touching.placed, touching.active, touching.columns
    instants, count = placed.shape[0], placed.shape[1]
    p, n = 0, 0
    for x in range(wide[0], wide[1] + 1):
        if not flags[x]:
            continue
        samples = _sample_count(flags[x] - 1) if instants > 1 else MIN_SAMPLES
        before = n
        for k in range(samples):
            sample = patterns[samples, k]
            dx, dy, dz = _sample_ray(buffers.rays, row, x, sample, hits.ray[:, n])
            # Neighbouring pixels take other instants: blur instead of ghosts.
            rank = int(patterns[samples, k, 2] * instants / samples + x * 5 + row * 3)
            instant = rank % instants
            nearest = FAR
            for i in range(active.shape[0]):
                if x < columns[i, 0] or x > columns[i, 1]:
                    continue
                c = active[i]
                solid = placed[instant, c, SHAPE]
                if solid == CAPSULE:
                    t, along = intersect(placed[instant, c], dx, dy, dz)
                elif solid == CYLINDER:
                    t, along = intersect_cylinder(placed[instant, c], dx, dy, dz)
                else:
                    t, along = intersect_solid(placed[instant, c], dx, dy, dz, touching.meshes)
                if t < nearest:
                    nearest = t
                    hits.distance[n], hits.along[n] = t, along
                    hits.capsule[n] = instant * count + c
            if nearest < FAR:
                n += 1
        pixels[p, 0], pixels[p, 1], pixels[p, 2] = x, samples, n - before
        p += 1
    return p, n


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _sample_ray(
    rays: Array32, row: int, x: int, sample: Array, out: Array
) -> tuple[float, float, float]:
    """Unit ray through the point sample[:2] px from a pixel's middle; also in out (3,)."""
    next_row = min(row + 1, rays.shape[0] - 1)
    next_x = min(x + 1, rays.shape[2] - 1)
    squared = 0.0
    for i in range(3):
        # How the ray changes from pixel to pixel; the last column and row look back.
        across = rays[row, i, next_x] - rays[row, i, next_x - 1]
        down = rays[next_row, i, x] - rays[next_row - 1, i, x]
        ray = rays[row, i, x] + sample[0] * across + sample[1] * down
        out[i] = ray
        squared += ray * ray
    scale = 1.0 / math.sqrt(squared)
    dx, dy, dz = out[0] * scale, out[1] * scale, out[2] * scale
    out[0], out[1], out[2] = dx, dy, dz
    return dx, dy, dz


@njit(cache=True, nogil=True, error_model="numpy")
def _average(p: int, pixels: Ints, hits: Hits, row: int, buffers: FrameBuffers) -> None:
    """Write the mean of each pixel's rays; those that hit nothing see the backdrop."""
    n = 0
    for i in range(p):
        x, samples, seen = pixels[i]
        for j in range(3):
            light = 0.0
            for k in range(n, n + seen):
                light += hits.rgb[j, k]
            behind = (samples - seen) * buffers.backdrop[row, x, j]
            buffers.light[row, x, j] = (light * buffers.vignette[row, x] + behind) / samples
        n += seen
