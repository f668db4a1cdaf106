"""What a ray sees where it meets a capsule: which surface, in which light. Compiled kernels. Pure.

Light is linear RGB; a lamp at infinity with a soft edge (wrapped Lambert), a fill lamp, light from
all around, a coloured rim lamp, and the highlight of the first (Blinn-Phong, with Schlick's
rational approximation of the power, 1994).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.render.ray_capsule import LOOK, Array32
from services.simulator.scene.catalog import Light
from services.simulator.scene.paints import Surface

# Skin lets light in: the shadow's edge is soft by this much.
_WRAP = 0.25
# Texels of the skin's texture, and how many of them a metre has: 2 mm each.
TEXELS = 64
_PER_METRE = 500.0
# Half width and depth of the creases at the palm side of the finger joints.
_CREASE_M, _CREASE = 1.1e-3, 0.22


def lights_of(light: Light, rotation: Array) -> Array:
    """(8, 3) rows: key direction and colour, fill direction and colour, rim direction and colour,
    ambient, up.

    rotation (3, 3) turns the first camera's frame into the frame of the camera that renders.
    """
    rows = [
        light.key_from,
        light.key,
        light.fill_from,
        light.fill,
        light.rim_from,
        light.rim,
        light.ambient,
        (0.0, -1.0, 0.0),
    ]
    lights = np.array(rows)
    for row in (0, 2, 4, 7):
        lights[row] = rotation @ (lights[row] / np.linalg.norm(lights[row]))
    return lights


def surfaces_of(surfaces: list[Surface], gains: Array) -> Array:
    """(m, 7): albedo as the camera's colour gains (3,) see it, gloss, shininess, texture, 1 for
    skin (the first surface).
    """
    rows = [
        (*(np.array(s.albedo) * gains), s.gloss, s.shininess, s.texture, 1.0 if i == 0 else 0.0)
        for i, s in enumerate(surfaces)
    ]
    return np.array(rows)


def texture(seed: int) -> Array32:
    """Blotches (TEXELS, TEXELS) float32 that tile, mean 0, within about -1..1."""
    rng = np.random.default_rng([seed, 13])
    spectrum = np.fft.rfft2(rng.standard_normal((TEXELS, TEXELS)))
    fy, fx = np.fft.fftfreq(TEXELS)[:, None], np.fft.rfftfreq(TEXELS)[None]
    r = np.hypot(fx, fy)
    noise = np.fft.irfft2(spectrum * np.exp(-((r / 0.16) ** 2)) / (r + 0.03), (TEXELS, TEXELS))
    noise -= noise.mean()
    return (np.clip(0.45 * noise / noise.std(), -1.0, 1.0)).astype(np.float32)


# Rows of a batch of hits: distance, along, ray (xyz) in; linear red, green, blue and the surface's
# number out.
HIT_T, HIT_ALONG, HIT_RAY, HIT_RGB, HIT_SURFACE, HITS = 0, 1, 2, 5, 8, 9


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def identify(n, hits, where, g, dabs, dab_r2, dab_surface):  # type: ignore[no-untyped-def]
    """Which surface each of n hits is on.

    where (n,) are rows of the placed capsules g (k, PLACED), dabs (instants, d, 3).
    """
    for i in range(n):
        c = where[i]
        t = hits[HIT_T, i]
        x, y, z = t * hits[HIT_RAY, i], t * hits[HIT_RAY + 1, i], t * hits[HIT_RAY + 2, i]
        surface = g[c, LOOK + 3]
        if g[c, LOOK + 4] >= 0.0:
            # Distance from the far end of the skin, along the bone.
            axial = (
                g[c, 3] * (x - g[c, 0]) + g[c, 4] * (y - g[c, 1]) + g[c, 5] * (z - g[c, 2])
            ) * g[c, 19]
            if g[c, 18] + g[c, 10] - axial < g[c, LOOK + 5]:
                surface = g[c, LOOK + 4]
        if g[c, LOOK + 6] > 0.0:
            k = int(g[c, LOOK + 7])
            for d in range(dab_r2.shape[0]):
                dx, dy, dz = x - dabs[k, d, 0], y - dabs[k, d, 1], z - dabs[k, d, 2]
                if dx * dx + dy * dy + dz * dz < dab_r2[d]:
                    surface = dab_surface[d]
        hits[HIT_SURFACE, i] = surface


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def shade(n, hits, where, g, looks, lights, blotches):  # type: ignore[no-untyped-def]
    """Linear light that n identified hits send back along their rays."""
    for i in range(n):
        c, s = where[i], int(hits[HIT_SURFACE, i])
        t, along = hits[HIT_T, i], hits[HIT_ALONG, i]
        x, y, z = hits[HIT_RAY, i], hits[HIT_RAY + 1, i], hits[HIT_RAY + 2, i]
        ax, ay, az = t * x - g[c, 0], t * y - g[c, 1], t * z - g[c, 2]
        nx, ny, nz = ax, ay, az
        if along > 0.0:
            if along < g[c, 16]:
                nx, ny, nz = (
                    g[c, 16] * ax - g[c, 3] * along,
                    g[c, 16] * ay - g[c, 4] * along,
                    g[c, 16] * az - g[c, 5] * along,
                )
            else:
                nx, ny, nz = ax - g[c, 3], ay - g[c, 4], az - g[c, 5]
        inverse = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz + 1e-30)
        nx, ny, nz = nx * inverse, ny * inverse, nz * inverse

        key = nx * lights[0, 0] + ny * lights[0, 1] + nz * lights[0, 2]
        lit = key + _WRAP
        diffuse = lit / (1.0 + _WRAP) if lit > 0.0 else 0.0
        fill = nx * lights[2, 0] + ny * lights[2, 1] + nz * lights[2, 2]
        fill = fill if fill > 0.0 else 0.0
        rim = nx * lights[4, 0] + ny * lights[4, 1] + nz * lights[4, 2]
        # The rim lamp's light is mostly mirrored: its colour hardly depends on what it falls on.
        rim = 0.5 * rim * rim if rim > 0.0 else 0.0
        sky = 0.7 + 0.3 * (nx * lights[7, 0] + ny * lights[7, 1] + nz * lights[7, 2])
        hx, hy, hz = lights[0, 0] - x, lights[0, 1] - y, lights[0, 2] - z
        cosine = (nx * hx + ny * hy + nz * hz) / math.sqrt(hx * hx + hy * hy + hz * hz)
        cosine = cosine if key > 0.0 and cosine > 0.0 else 0.0
        highlight = looks[s, 3] * cosine / (looks[s, 4] - looks[s, 4] * cosine + cosine)

        palmar = nx * g[c, LOOK] + ny * g[c, LOOK + 1] + nz * g[c, LOOK + 2]
        axial = (g[c, 3] * ax + g[c, 4] * ay + g[c, 5] * az) * g[c, 19]
        u, v = (
            int(axial * _PER_METRE + 4096.0) & (TEXELS - 1),
            int((palmar + 1.0) * 10.0 + 1e4 * g[c, 9]) & (TEXELS - 1),
        )
        tone = 1.0 + looks[s, 5] * blotches[u, v]
        rest = tone
        if looks[s, 6] > 0.0:
            # Palms are pinker, the back of the hand is browner, and skin folds at the joints.
            rest *= 1.0 + 0.05 * palmar
            if palmar > 0.15 and abs(axial) < _CREASE_M and g[c, 9] < 0.013:
                fold = 1.0 - _CREASE + _CREASE * abs(axial) / _CREASE_M
                tone, rest = tone * fold, rest * fold
        for j in range(3):
            light = lights[1, j] * diffuse + lights[3, j] * fill + lights[6, j] * sky
            hits[HIT_RGB + j, i] = (
                looks[s, j] * (tone if j == 0 else rest) * light
                + highlight * lights[1, j]
                + rim * lights[5, j]
            )
