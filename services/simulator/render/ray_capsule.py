"""Rays and tapered capsules as compiled kernels, in one camera's frame. Pure.

A capsule is the hull of two balls. While a frame is exposed it moves along a parabola in u = -1..1
(render_paths). Capsules must lie before the camera; one that does not is drawn nowhere.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array

Array32 = npt.NDArray[np.float32]

# Fields of a placed capsule: 0 a, 3 b - a, 6 b (xyz each), 9 radii and products of these that `hit`
# needs; from LOOK on what `shade` needs, written once by `dress`: palmar direction (xyz), surface,
# end surface, end length, dabbed, instant.
LOOK = 20
PLACED = LOOK + 8
FAR = 1e9


def rays_of(camera: Camera) -> Array32:
    """Unit direction of every pixel's ray in the camera frame.

    (h, 3, w) float32, so that rows are contiguous.
    """
    w, h = camera.size_px
    x, y = np.meshgrid(np.arange(w, dtype=np.float64), np.arange(h, dtype=np.float64))
    pixels = np.stack([x.ravel(), y.ravel()], axis=1)
    xy = camera.rays_from_pixels(pixels)
    # A lens model that folds over has no ray for its outermost pixels; real ones show a dim rim
    # there, which a plain pinhole stands for.
    plain = Camera(
        camera.name, camera.size_px, camera.matrix, np.zeros(5), camera.T_rig_from_camera
    )
    xy = np.where(np.isnan(xy), plain.rays_from_pixels(pixels), xy)
    rays = np.concatenate([xy, np.ones((h * w, 1))], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return np.ascontiguousarray(rays.reshape(h, w, 3).transpose(0, 2, 1).astype(np.float32))


def lens_of(camera: Camera) -> Array:
    """(9,): fx, fy, cx, cy, k1, k2, p1, p2, k3."""
    m = camera.matrix
    return np.concatenate([[m[0, 0], m[1, 1], m[0, 2], m[1, 2]], camera.distortion])


@njit(cache=True, nogil=True, error_model="numpy")
def project(lens, x, y, z):  # type: ignore[no-untyped-def]
    """Pixel of a point before the camera; rhot.geometry.camera.Camera.project_camera."""
    x, y = x / z, y / z
    r2 = x * x + y * y
    radial = 1.0 + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]))
    xd = x * radial + 2.0 * lens[6] * x * y + lens[7] * (r2 + 2.0 * x * x)
    yd = y * radial + lens[6] * (r2 + 2.0 * y * y) + 2.0 * lens[7] * x * y
    return lens[0] * xd + lens[2], lens[1] * yd + lens[3]


@njit(cache=True, nogil=True, error_model="numpy")
def place(ends, ra, rb, u, g):  # type: ignore[no-untyped-def]
    """One capsule at instant u: everything about it that does not depend on the ray.

    G (PLACED,).
    """
    ba2, m1, m5, m7 = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        a = ends[0, 0, i] + u * (ends[0, 1, i] + u * ends[0, 2, i])
        b = ends[1, 0, i] + u * (ends[1, 1, i] + u * ends[1, 2, i])
        g[i], g[3 + i], g[6 + i] = a, b - a, b
        ba2 += (b - a) * (b - a)
        m1 -= (b - a) * a
        m5 += a * a
        m7 += b * b
    rr = ra - rb
    d2 = ba2 - rr * rr
    g[9], g[10], g[11] = ra, rb, rr
    g[12], g[13] = ba2, m1
    g[14], g[15] = m5 - ra * ra, m7 - rb * rb
    # One ball inside the other leaves no cone between them.
    g[16] = d2 if d2 > 1e-12 else 0.0
    g[17] = d2 * m5 - m1 * m1 + 2.0 * m1 * rr * ra - ba2 * ra * ra
    g[18] = math.sqrt(ba2)
    g[19] = 1.0 / max(g[18], 1e-9)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def hit(g, x, y, z):  # type: ignore[no-untyped-def]
    """(distance, along) of the first point where a ray (unit, from the origin) meets a capsule;
    distance FAR if nowhere.

    along is 0 on ball a, the squared slant length g[16] on ball b, and between on the cone. Closed
    form after I. Quilez, "Ray-surface intersection functions", rounded cone; the balls lie inside
    the hull, so the nearest candidate is right.
    """
    d2 = g[16]
    m2 = g[3] * x + g[4] * y + g[5] * z
    m3 = -(x * g[0] + y * g[1] + z * g[2])
    best, reach = FAR, 0.0
    if d2 > 0.0:
        k2 = d2 - m2 * m2
        k1 = d2 * m3 + m2 * (g[11] * g[9] - g[13])
        h = k1 * k1 - g[17] * k2
        if h < 0.0:
            return FAR, 0.0
        t = -(math.sqrt(h) + k1) / k2
        along = g[13] - g[9] * g[11] + t * m2
        if along > 0.0 and along < d2:
            if k2 > 0.0:
                return t, along
            best, reach = t, along
    h = m3 * m3 - g[14]
    if h > 0.0:
        t = -m3 - math.sqrt(h)
        if t < best:
            best, reach = t, 0.0
    m6 = -(x * g[6] + y * g[7] + z * g[8])
    h = m6 * m6 - g[15]
    if h > 0.0:
        t = -m6 - math.sqrt(h)
        if t < best:
            best, reach = t, d2
    return best, reach


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def hit_row(g, rays, first, last, capsule, depth, owner, reach):  # type: ignore[no-untyped-def]
    """`hit` for the pixels first..last of one row (3, w), keeping the nearest.

    Free of branches, so that it compiles to SIMD.
    """
    ax, ay, az, bx, by, bz = g[0], g[1], g[2], g[6], g[7], g[8]
    ux, uy, uz = g[3], g[4], g[5]
    d2, k0, ca, cb = g[16], g[17], g[14], g[15]
    q, y0 = g[11] * g[9] - g[13], g[13] - g[9] * g[11]
    rx, ry, rz = rays[0], rays[1], rays[2]
    for i in range(first, last + 1):
        x, y, z = float(rx[i]), float(ry[i]), float(rz[i])
        m2 = ux * x + uy * y + uz * z
        m3 = -(x * ax + y * ay + z * az)
        m6 = -(x * bx + y * by + z * bz)
        k2 = d2 - m2 * m2
        k1 = d2 * m3 + m2 * q
        h = k1 * k1 - k0 * k2
        tc = -(math.sqrt(max(h, 0.0)) + k1) / (k2 + 1e-300)
        along = y0 + tc * m2
        cone = (h >= 0.0) & (along > 0.0) & (along < d2)
        t = tc if cone else FAR
        where = along if cone else 0.0
        h = m3 * m3 - ca
        ta = -m3 - math.sqrt(max(h, 0.0)) if h > 0.0 else FAR
        where = 0.0 if ta < t else where
        t = min(t, ta)
        h = m6 * m6 - cb
        tb = -m6 - math.sqrt(max(h, 0.0)) if h > 0.0 else FAR
        where = d2 if tb < t else where
        t = min(t, tb)
        nearer = t < depth[i]
        depth[i] = t if nearer else depth[i]
        reach[i] = where if nearer else reach[i]
        owner[i] = capsule if nearer else owner[i]


@njit(cache=True, nogil=True)
def dress(palms, kind, end_m, g):  # type: ignore[no-untyped-def]
    """Write what does not move into the table g (instants, c, PLACED)."""
    for k in range(g.shape[0]):
        for c in range(g.shape[1]):
            for i in range(3):
                g[k, c, LOOK + i] = palms[c, 0, i]
            g[k, c, LOOK + 3], g[k, c, LOOK + 4], g[k, c, LOOK + 5] = (
                kind[c, 0],
                kind[c, 1],
                end_m[c],
            )
            g[k, c, LOOK + 6], g[k, c, LOOK + 7] = kind[c, 2], k
