"""Several rays where one is not enough: at outlines, at the edges of paint, and along the way these
move while the shutter is open.

Compiled kernels. Pure. Inside a surface a second ray would see nearly the same: shading is smooth
there.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.render.motion_paths import columns_of
from services.simulator.render.ray_capsule import FAR, PLACED, dress, hit, place
from services.simulator.render.shade import (
    HIT_ALONG,
    HIT_RAY,
    HIT_RGB,
    HIT_T,
    HITS,
    identify,
    shade,
)
from services.simulator.render.trace import dabs_at

# Neighbours further apart in depth than this are different things: half a finger.
_STEP_M = 4e-3
# Less movement than this while the shutter is open is not worth several instants.
_STILL_PX = 0.3
# Samples a pixel at the outline of something still, and at most. Measured on a drifting finger tip:
# 4 samples move its centroid by 0.037 px RMS, 6 by under 0.015, 12 no less. A step of 1.5 px
# between instants vanishes in the lens blur.
_SAMPLES, _MAX_SAMPLES, _STEP_PX = 6, 12, 1.5
# Random arrangements tried for each number of samples.
_TRIES = 300
# Longest way that is followed, px: flags are bytes, and a third of the picture is a hand thrown,
# not moved.
_MAX_WAY_PX = 200.0


def patterns() -> Array:
    """Where n samples of a pixel lie: (n, k) -> x and y from its middle in px, rank in time 0..n-1;
    (_MAX_SAMPLES + 1, _MAX_SAMPLES, 3).

    Latin squares: each row, column and instant of an n-fold pixel once, so the mean lies exactly in
    the middle (an uneven pattern would shift every outline); of many arrangements the one whose
    samples keep furthest apart.
    """
    rng = np.random.default_rng(1)
    table = np.zeros((_MAX_SAMPLES + 1, _MAX_SAMPLES, 3))
    for n in range(_SAMPLES, _MAX_SAMPLES + 1):
        tries = np.stack(
            [
                np.tile(np.arange(n), (_TRIES, 1)),
                *(rng.permuted(np.tile(np.arange(n), (_TRIES, 1)), axis=1) for _ in "yt"),
            ],
            2,
        )
        apart = np.abs(tries[:, :, None] - tries[:, None, :])  # (tries, n, n, 3)
        apart = np.minimum(apart, n - apart)
        in_space, in_all = np.sum(apart[..., :2] ** 2, axis=3), np.sum(apart**2, axis=3)
        score = np.min((in_space + 0.5 * in_all) + 1e6 * np.eye(n), axis=(1, 2))
        best = tries[int(np.argmax(score))]
        table[n, :n, :2] = (best[:, :2] + 0.5) / n - 0.5
        table[n, :n, 2] = best[:, 2]
    return table


@njit(cache=True, nogil=True, error_model="numpy")
def _smear(flags, y, x, vx, vy, mark):  # type: ignore[no-untyped-def]
    """Mark the way that the content of a pixel goes while the shutter is open, one pixel wide on
    either side.
    """
    height, width = flags.shape
    steps = int(max(abs(vx), abs(vy)) * 0.5 + 1.0)
    for k in range(-steps, steps + 1):
        cx, cy = (
            math.floor(x + 0.5 * vx * k / steps + 0.5),
            math.floor(y + 0.5 * vy * k / steps + 0.5),
        )
        for v in range(max(0, cy - 1), min(height, cy + 2)):
            for w in range(max(0, cx - 1), min(width, cx + 2)):
                flags[v, w] = max(flags[v, w], mark)


@njit(cache=True, nogil=True, error_model="numpy")
def _motion(world, owner, y, x, shutter):  # type: ignore[no-untyped-def]
    """How far (px) the nearer end of a pixel's capsule moves while the shutter is open."""
    track = world.tracks[owner]
    to_a = (track[0, 0, 0] - x) ** 2 + (track[0, 0, 1] - y) ** 2
    to_b = (track[1, 0, 0] - x) ** 2 + (track[1, 0, 1] - y) ** 2
    end = 0 if to_a < to_b else 1
    return track[end, 1, 0] * shutter, track[end, 1, 1] * shutter


@njit(cache=True, nogil=True, error_model="numpy")
def outlines(world, film, shutter):  # type: ignore[no-untyped-def]
    """Flag every pixel that needs more than one ray, by 1 + the way in px its outline goes while
    the shutter is open; the longest way.

    shutter: exposure in units of u. flags must be 0.
    """
    height, width = film.depth.shape
    longest = 0.0
    for y in range(height - 1):
        first, last = (
            min(film.ranges[y, 0], film.ranges[y + 1, 0]),
            max(film.ranges[y, 1], film.ranges[y + 1, 1]),
        )
        here, below, far_here, far_below = (
            film.label[y],
            film.label[y + 1],
            film.depth[y],
            film.depth[y + 1],
        )
        for x in range(max(0, first - 1), min(width - 1, last + 1)):
            right = here[x] != here[x + 1] or abs(far_here[x] - far_here[x + 1]) > _STEP_M
            down = here[x] != below[x] or abs(far_here[x] - far_below[x]) > _STEP_M
            if not right and not down:
                continue
            film.flags[y, x] = max(film.flags[y, x], 1)
            v, w, nearest = y, x, far_here[x]
            if right:
                film.flags[y, x + 1] = max(film.flags[y, x + 1], 1)
                if far_here[x + 1] < nearest:
                    w, nearest = x + 1, far_here[x + 1]
            if down:
                film.flags[y + 1, x] = max(film.flags[y + 1, x], 1)
                if far_below[x] < nearest:
                    v, w = y + 1, x
            # What is in front makes the outline, and its motion smears it.
            vx, vy = _motion(world, film.owner[v, w], v, w, shutter)
            way = math.hypot(vx, vy)
            if way > _STILL_PX:
                way = min(way, _MAX_WAY_PX)
                longest = max(longest, way)
                _smear(film.flags, y, x, vx, vy, 1 + int(way))
    return longest


@njit(cache=True, nogil=True, error_model="numpy")
def widen(ranges, margin, reach):  # type: ignore[no-untyped-def]
    """reach (h, 2): the touched columns of each row and of `margin` rows about it, `margin` wider,
    on even boundaries; empty: (w, -1).
    """
    height = ranges.shape[0]
    for y in range(height):
        reach[y, 0], reach[y, 1] = 1 << 30, -1
    for y in range(height):
        if ranges[y, 1] < ranges[y, 0]:
            continue
        first, last = max(0, ranges[y, 0] - margin) // 2 * 2, (ranges[y, 1] + margin) // 2 * 2 + 1
        # Chroma belongs to pairs of rows: both of a pair reach equally far.
        for v in range(max(0, y - margin) // 2 * 2, min(height, (y + margin) // 2 * 2 + 2)):
            reach[v, 0], reach[v, 1] = min(reach[v, 0], first), max(reach[v, 1], last)


@njit(cache=True, nogil=True, error_model="numpy")
def _samples(way):  # type: ignore[no-untyped-def]
    return min(_MAX_SAMPLES, max(_SAMPLES, int(way / _STEP_PX) + 2))


@njit(cache=True, nogil=True, error_model="numpy")
def _placed(world, row, u, shutter, instants, width, g, active, columns):  # type: ignore[no-untyped-def]
    """Place the capsules that touch a row at every instant.

    How many, which, and between which columns.
    """
    n = 0
    for c in range(world.ends.shape[0]):
        if row < world.spans[c, 0] or row > world.spans[c, 1]:
            continue
        x0, x1 = columns_of(world.tracks[c], u, row, width)
        if instants > 1:
            for k in (-0.5, 0.5):
                p, q = columns_of(world.tracks[c], u + k * shutter, row, width)
                if q >= p:
                    x0, x1 = (min(x0, p), max(x1, q)) if x1 >= x0 else (p, q)
        if x1 < x0:
            continue
        active[n], columns[n, 0], columns[n, 1] = c, x0 - 1, x1 + 1
        for k in range(instants):
            place(
                world.ends[c],
                world.radius[c, 0],
                world.radius[c, 1],
                u + ((k + 0.5) / instants - 0.5) * shutter,
                g[k, c],
            )
        n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def retrace(world, film, timing, shutter, longest, reach):  # type: ignore[no-untyped-def]
    """The mean of several rays, over its area and the exposure, for each flagged pixel inside reach
    (h, 2): first and last column.
    """
    width = film.depth.shape[1]
    count = world.ends.shape[0]
    instants = 1 if longest <= _STILL_PX else _samples(longest)
    g = np.empty((instants, count, PLACED))
    dress(world.palms, world.kind, world.end_m, g)
    dabs = np.empty((instants, world.dabs.shape[0], 3))
    active, columns = np.empty(count, np.int64), np.empty((count, 2), np.int64)
    most = _MAX_SAMPLES * width
    hits, where, pixels = (
        np.empty((HITS, most)),
        np.empty(most, np.int64),
        np.empty((width, 3), np.int64),
    )
    flat = g.reshape(instants * count, PLACED)
    for row in range(film.depth.shape[0]):
        if reach[row, 1] < reach[row, 0] or not np.any(
            film.flags[row, reach[row, 0] : reach[row, 1] + 1]
        ):
            continue
        u = timing[0] + row * timing[1]
        touched = _placed(world, row, u, shutter, instants, width, g, active, columns)
        for k in range(instants):
            dabs_at(world.dabs, u + ((k + 0.5) / instants - 0.5) * shutter, dabs[k])
        p, n = _cast(
            film.rays,
            film.pattern,
            film.flags[row],
            row,
            reach[row],
            instants,
            touched,
            active,
            columns,
            flat,
            hits,
            where,
            pixels,
        )
        identify(n, hits, where, flat, dabs, world.dab_r2, world.dab_surface)
        shade(n, hits, where, flat, world.looks, world.lights, world.blotches)
        _average(p, pixels, hits, film.vignette[row], film.backdrop[row], film.picture[row])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _cast(
    rays, pattern, flags, row, reach, instants, touched, active, columns, g, hits, where, pixels
):  # type: ignore[no-untyped-def]
    """The rays of a row's flagged pixels: what they hit, and pixels (p, 3): column, rays cast, rays
    that hit. Returns p and hits.
    """
    height, width, count = rays.shape[0], rays.shape[2], g.shape[0] // instants
    yn = min(row + 1, height - 1)
    p, n = 0, 0
    for x in range(reach[0], reach[1] + 1):
        if not flags[x]:
            continue
        samples = _samples(flags[x] - 1) if instants > 1 else _SAMPLES
        xn, before = min(x + 1, width - 1), n
        for k in range(samples):
            ox, oy = pattern[samples, k, 0], pattern[samples, k, 1]
            scale = 0.0
            for i in range(3):
                # How the ray changes from pixel to pixel; the last column and row look back.
                across, down = (
                    rays[row, i, xn] - rays[row, i, xn - 1],
                    rays[yn, i, x] - rays[yn - 1, i, x],
                )
                ray = rays[row, i, x] + ox * across + oy * down
                hits[HIT_RAY + i, n] = ray
                scale += ray * ray
            scale = 1.0 / math.sqrt(scale)
            dx, dy, dz = (
                hits[HIT_RAY, n] * scale,
                hits[HIT_RAY + 1, n] * scale,
                hits[HIT_RAY + 2, n] * scale,
            )
            hits[HIT_RAY, n], hits[HIT_RAY + 1, n], hits[HIT_RAY + 2, n] = dx, dy, dz
            # Neighbouring pixels take other instants: blur instead of ghosts.
            instant = int(pattern[samples, k, 2] * instants / samples + x * 5 + row * 3) % instants
            nearest = FAR
            for i in range(touched):
                if x < columns[i, 0] or x > columns[i, 1]:
                    continue
                t, along = hit(g[instant * count + active[i]], dx, dy, dz)
                if t < nearest:
                    nearest = t
                    hits[HIT_T, n], hits[HIT_ALONG, n], where[n] = (
                        t,
                        along,
                        instant * count + active[i],
                    )
            if nearest < FAR:
                n += 1
        pixels[p, 0], pixels[p, 1], pixels[p, 2] = x, samples, n - before
        p += 1
    return p, n


@njit(cache=True, nogil=True, error_model="numpy")
def _average(p, pixels, hits, vignette, backdrop, picture):  # type: ignore[no-untyped-def]
    n = 0
    for i in range(p):
        x, samples, seen = pixels[i]
        for j in range(3):
            light = 0.0
            for k in range(n, n + seen):
                light += hits[HIT_RGB + j, k]
            picture[x, j] = (light * vignette[x] + (samples - seen) * backdrop[x, j]) / samples
        n += seen
