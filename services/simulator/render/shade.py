"""What a ray sees where it meets a capsule: which surface, in which light. Compiled kernels. Pure.

Shading: wrapped Lambert for the key lamp, whose edge is soft, Lambert for the fill lamp, ambient
light from all around, and the key lamp's highlight (Blinn-Phong, with Schlick's rational
approximation of the power, 1994).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import CAPSULE, Ints
from services.simulator.render.buffers import Surfaces
from services.simulator.render.materials import (
    AMBIENT,
    FILL,
    FILL_DIRECTION,
    GLOSS,
    IS_SKIN,
    KEY,
    KEY_DIRECTION,
    RIM,
    RIM_DIRECTION,
    SHININESS,
    TEXELS,
    TEXTURE,
    UP,
)
from services.simulator.render.ray_capsule import (
    AXIS,
    DABBED,
    END_A,
    END_LEAN,
    END_LENGTH,
    END_SURFACE,
    INSTANT,
    INVERSE_LENGTH,
    LENGTH,
    PALMAR,
    RADIUS_A,
    RADIUS_B,
    SLANT_SQUARED,
    SURFACE,
)
from services.simulator.render.ray_solid import SHAPE, solid_normal

# Skin lets light in: the shadow's edge is soft by this much.
_WRAP = 0.25
# Texels of the skin's texture a metre: 2 mm each.
_TEXELS_PER_METRE = 500.0
# Half width and depth of the creases at the palm side of the finger joints.
_CREASE_M, _CREASE = 1.1e-3, 0.22
# Joints thicker than this (knuckles, palm) have no crease.
_CREASE_RADIUS_M = 0.013


class Hits(NamedTuple):
    """A batch of rays that hit something, side by side; only the first n are filled."""

    distance: Array  # (n,) m
    along: Array  # (n,) as `ray_capsule.intersect` gives it
    ray: Array  # (3, n) unit vectors
    capsule: Ints  # (n,) row of the table of placed capsules
    surface: Ints  # (n,) set by `identify`
    rgb: Array  # (3, n) linear light, set by `shade`


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def identify(
    n: int, hits: Hits, g: Array, dabs: Array, dab_radius_squared: Array, dab_surface: Ints
) -> None:
    """Find which surface each of n hits is on.

    g (k, PLACED) are placed capsules, dabs (instants, d, 3) the dabs' centres.
    """
    for i in range(n):
        c = hits.capsule[i]
        t = hits.distance[i]
        x, y, z = t * hits.ray[0, i], t * hits.ray[1, i], t * hits.ray[2, i]
        surface = g[c, SURFACE]
        if g[c, END_SURFACE] >= 0.0:
            # Distance from the far end of the skin, along the bone.
            axial = (
                g[c, AXIS] * (x - g[c, END_A])
                + g[c, AXIS + 1] * (y - g[c, END_A + 1])
                + g[c, AXIS + 2] * (z - g[c, END_A + 2])
            ) * g[c, INVERSE_LENGTH]
            painted = g[c, END_LENGTH]
            if g[c, END_LEAN] > 0.0:
                painted += _lean(g[c], x, y, z)
            if g[c, LENGTH] + g[c, RADIUS_B] - axial < painted:
                surface = g[c, END_SURFACE]
        if g[c, DABBED] > 0.0:
            k = int(g[c, INSTANT])
            for d in range(dab_surface.shape[0]):
                dx, dy, dz = x - dabs[k, d, 0], y - dabs[k, d, 1], z - dabs[k, d, 2]
                if dx * dx + dy * dy + dz * dz < dab_radius_squared[d]:
                    surface = dab_surface[d]
        hits.surface[i] = int(surface)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _lean(g: Array, x: float, y: float, z: float) -> float:
    """By how much an uneven painted end is longer on the side of its bone where (x, y, z) lies."""
    inverse = g[INVERSE_LENGTH]
    ux, uy, uz = g[AXIS] * inverse, g[AXIS + 1] * inverse, g[AXIS + 2] * inverse
    rx, ry, rz = x - g[END_A], y - g[END_A + 1], z - g[END_A + 2]
    axial = rx * ux + ry * uy + rz * uz
    rx, ry, rz = rx - axial * ux, ry - axial * uy, rz - axial * uz
    px, py, pz = g[PALMAR], g[PALMAR + 1], g[PALMAR + 2]
    palm = rx * px + ry * py + rz * pz
    right = rx * (uy * pz - uz * py) + ry * (uz * px - ux * pz) + rz * (ux * py - uy * px)
    scale = 1.0 / math.sqrt(palm * palm + right * right + 1e-30)
    palm, right = palm * scale, right * scale
    return (
        g[END_LEAN + 1] * palm
        + g[END_LEAN + 2] * right
        + g[END_LEAN + 3] * (palm * palm - right * right)
    )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def shade(n: int, hits: Hits, g: Array, surfaces: Surfaces) -> None:
    """Linear light that n identified hits send back along their rays; g (k, PLACED)."""
    lights, materials = surfaces.lights, surfaces.materials
    for i in range(n):
        c, s = hits.capsule[i], hits.surface[i]
        t = hits.distance[i]
        x, y, z = hits.ray[0, i], hits.ray[1, i], hits.ray[2, i]
        ax, ay, az = t * x - g[c, END_A], t * y - g[c, END_A + 1], t * z - g[c, END_A + 2]
        if g[c, SHAPE] == CAPSULE:
            nx, ny, nz = _normal(g[c], hits.along[i], ax, ay, az)
        else:
            nx, ny, nz = solid_normal(g[c], int(hits.along[i]), (ax, ay, az), surfaces.facets)

        diffuse, fill, rim, sky, cosine = light_on(lights, (nx, ny, nz), (x, y, z))
        shininess = materials[s, SHININESS]
        highlight = materials[s, GLOSS] * cosine / (shininess - shininess * cosine + cosine)

        palmar = nx * g[c, PALMAR] + ny * g[c, PALMAR + 1] + nz * g[c, PALMAR + 2]
        axial = (g[c, AXIS] * ax + g[c, AXIS + 1] * ay + g[c, AXIS + 2] * az) * g[c, INVERSE_LENGTH]
        radius = g[c, RADIUS_A]
        u = int(axial * _TEXELS_PER_METRE + 4096.0) & (TEXELS - 1)
        v = int((palmar + 1.0) * 10.0 + 1e4 * radius) & (TEXELS - 1)
        tone = 1.0 + materials[s, TEXTURE] * surfaces.texture[u, v]
        # Red, and green and blue together: skin changes its hue.
        red, rest = tone, tone
        if materials[s, IS_SKIN] > 0.0:
            red, rest = _skin_tone(tone, palmar, axial, radius)
        for j in range(3):
            light = lights[KEY, j] * diffuse + lights[FILL, j] * fill + lights[AMBIENT, j] * sky
            hits.rgb[j, i] = (
                materials[s, j] * (red if j == 0 else rest) * light
                + highlight * lights[KEY, j]
                + rim * lights[RIM, j]
            )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _normal(g: Array, along: float, ax: float, ay: float, az: float) -> tuple[float, float, float]:
    """Unit normal of a placed capsule at the point (ax, ay, az) from the centre of its ball a."""
    nx, ny, nz = ax, ay, az
    if along > 0.0:
        slant = g[SLANT_SQUARED]
        if along < slant:
            nx = slant * ax - g[AXIS] * along
            ny = slant * ay - g[AXIS + 1] * along
            nz = slant * az - g[AXIS + 2] * along
        else:
            nx, ny, nz = ax - g[AXIS], ay - g[AXIS + 1], az - g[AXIS + 2]
    inverse = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz + 1e-30)
    return nx * inverse, ny * inverse, nz * inverse


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def light_on(
    lights: Array, normal: tuple[float, float, float], ray: tuple[float, float, float]
) -> tuple[float, float, float, float, float]:
    """Shares of key, fill, rim and ambient light, and the cosine of the key lamp's highlight.

    normal and ray are unit vectors.
    """
    nx, ny, nz = normal
    x, y, z = ray
    kx, ky, kz = lights[KEY_DIRECTION, 0], lights[KEY_DIRECTION, 1], lights[KEY_DIRECTION, 2]
    key = nx * kx + ny * ky + nz * kz
    wrapped = key + _WRAP
    diffuse = wrapped / (1.0 + _WRAP) if wrapped > 0.0 else 0.0
    fill = (
        nx * lights[FILL_DIRECTION, 0]
        + ny * lights[FILL_DIRECTION, 1]
        + nz * lights[FILL_DIRECTION, 2]
    )
    fill = fill if fill > 0.0 else 0.0
    rim = (
        nx * lights[RIM_DIRECTION, 0]
        + ny * lights[RIM_DIRECTION, 1]
        + nz * lights[RIM_DIRECTION, 2]
    )
    # The rim lamp's light is mostly mirrored: its colour hardly depends on what it falls on.
    rim = 0.5 * rim * rim if rim > 0.0 else 0.0
    sky = 0.7 + 0.3 * (nx * lights[UP, 0] + ny * lights[UP, 1] + nz * lights[UP, 2])
    # Halfway vector between lamp and viewer.
    hx, hy, hz = kx - x, ky - y, kz - z
    cosine = (nx * hx + ny * hy + nz * hz) / math.sqrt(hx * hx + hy * hy + hz * hz)
    cosine = cosine if key > 0.0 and cosine > 0.0 else 0.0
    return diffuse, fill, rim, sky, cosine


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _skin_tone(tone: float, palmar: float, axial: float, radius: float) -> tuple[float, float]:
    """Factors of red, and of green and blue.

    Palms are pinker, the back of the hand is browner, and skin folds at the joints.
    """
    rest = tone * (1.0 + 0.05 * palmar)
    if palmar > 0.15 and abs(axial) < _CREASE_M and radius < _CREASE_RADIUS_M:
        fold = 1.0 - _CREASE + _CREASE * abs(axial) / _CREASE_M
        return tone * fold, rest * fold
    return tone, rest
