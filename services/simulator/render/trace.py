"""Tracing a picture row by row, each row at its own instant (rolling shutter): one ray a pixel.

Compiled kernels. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.render.motion_paths import columns_of
from services.simulator.render.ray_capsule import FAR, PLACED, Array32, dress, hit_row, place
from services.simulator.render.shade import (
    HIT_ALONG,
    HIT_RAY,
    HIT_RGB,
    HIT_SURFACE,
    HIT_T,
    HITS,
    identify,
    shade,
)
from services.simulator.scene.bodies import Ints


class World(NamedTuple):
    """What there is to see: c capsules on their paths, d dabs, m surfaces."""

    ends: Array  # (c, 2, 3, 3)
    palms: Array  # (c, 3, 3)
    tracks: Array  # (c, 2, 3, 3)
    spans: Ints  # (c, 2)
    radius: Array  # (c, 2)
    kind: Ints  # (c, 3)
    end_m: Array  # (c,)
    dabs: Array  # (d, 3, 3)
    dab_r2: Array  # (d,)
    dab_surface: Ints  # (d,)
    looks: Array  # (m, 7)
    lights: Array  # (8, 3)
    blotches: Array32  # (TEXELS, TEXELS)


class Film(NamedTuple):
    """What is exposed.

    depth FAR, owner (capsule), label (1 + surface) and flags 0 mean background; ranges: touched
    columns of a row.
    """

    rays: Array32  # (h, 3, w)
    vignette: Array32  # (h, w)
    backdrop: Array32  # (h, w, 3)
    depth: Array32  # (h, w)
    owner: npt.NDArray[np.int16]  # (h, w)
    label: npt.NDArray[np.int16]  # (h, w)
    flags: npt.NDArray[np.uint8]  # (h, w)
    ranges: Ints  # (h, 2)
    picture: Array32  # (h, w, 3)
    pattern: Array  # (n, k, 3), services/simulator/render/antialias.py


@njit(cache=True, nogil=True, error_model="numpy")
def dabs_at(paths, u, out):  # type: ignore[no-untyped-def]
    """Where the dabs are at instant u; out (d, 3)."""
    for d in range(paths.shape[0]):
        for i in range(3):
            out[d, i] = paths[d, 0, i] + u * (paths[d, 1, i] + u * paths[d, 2, i])


@njit(cache=True, nogil=True, error_model="numpy")
def trace(world, film, timing):  # type: ignore[no-untyped-def]
    """Fill depth, owner, label, ranges and picture with one ray through each pixel.

    Timing: u of row 0 and of each further row.
    """
    height, width = film.depth.shape
    count = world.ends.shape[0]
    g = np.empty((1, count, PLACED))
    dress(world.palms, world.kind, world.end_m, g)
    dabs = np.empty((1, world.dabs.shape[0], 3))
    depth, reach, owner = np.empty(width), np.empty(width), np.empty(width, np.int64)
    hits, where, columns = (
        np.empty((HITS, width)),
        np.empty(width, np.int64),
        np.empty(width, np.int64),
    )
    for row in range(height):
        u = timing[0] + row * timing[1]
        first, last = width, -1
        depth[:] = FAR
        for c in range(count):
            if row < world.spans[c, 0] or row > world.spans[c, 1]:
                continue
            x0, x1 = columns_of(world.tracks[c], u, row, width)
            if x1 < x0:
                continue
            place(world.ends[c], world.radius[c, 0], world.radius[c, 1], u, g[0, c])
            hit_row(g[0, c], film.rays[row], x0, x1, c, depth, owner, reach)
            first, last = min(first, x0), max(last, x1)
        film.ranges[row, 0], film.ranges[row, 1] = first, last
        if last >= first:
            n = _collect(film.rays[row], first, last, depth, reach, owner, hits, where, columns)
            dabs_at(world.dabs, u, dabs[0])
            identify(n, hits, where, g[0], dabs, world.dab_r2, world.dab_surface)
            shade(n, hits, where, g[0], world.looks, world.lights, world.blotches)
            _develop(
                n,
                hits,
                where,
                columns,
                film.vignette[row],
                film.depth[row],
                film.owner[row],
                film.label[row],
                film.picture[row],
            )


@njit(cache=True, nogil=True, error_model="numpy")
def _collect(rays, first, last, depth, reach, owner, hits, where, columns):  # type: ignore[no-untyped-def]
    """The pixels of a row that meet something, side by side; returns how many."""
    n = 0
    for x in range(first, last + 1):
        if depth[x] < FAR:
            hits[HIT_T, n], hits[HIT_ALONG, n] = depth[x], reach[x]
            hits[HIT_RAY, n], hits[HIT_RAY + 1, n], hits[HIT_RAY + 2, n] = (
                rays[0, x],
                rays[1, x],
                rays[2, x],
            )
            where[n], columns[n] = owner[x], x
            n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _develop(n, hits, where, columns, vignette, depth, owner, label, picture):  # type: ignore[no-untyped-def]
    for i in range(n):
        x = columns[i]
        depth[x], owner[x], label[x] = hits[HIT_T, i], where[i], 1 + int(hits[HIT_SURFACE, i])
        for j in range(3):
            picture[x, j] = hits[HIT_RGB + j, i] * vignette[x]
