"""Surfaces and light of a scene as arrays for the shading kernels. Pure.

Light is linear RGB: a key lamp at infinity, a fill lamp, light from all around, and a coloured rim
lamp.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.simulator.render.buffers import Surfaces
from services.simulator.render.projection import Array32
from services.simulator.scene.catalog import Light
from services.simulator.scene.paints import Surface

# Texels of the skin's texture along either side.
TEXELS = 64
# Rows of the table of lights.
KEY_DIRECTION, KEY, FILL_DIRECTION, FILL, RIM_DIRECTION, RIM, AMBIENT, UP = range(8)
# Columns of the table of materials, after red, green and blue.
GLOSS, SHININESS, TEXTURE, IS_SKIN = 3, 4, 5, 6


def surfaces_in_light(
    surfaces: list[Surface],
    gains: Array,
    light: Light,
    rotation: Array,
    seed: int,
    facets: Array,
) -> Surfaces:
    """How surfaces look to a camera with colour gains (3,).

    rotation (3, 3) turns the first camera's frame, in which `light` is given, into the frame of the
    camera that renders. facets (f, 3) are the normals of meshes' triangles.
    """
    return Surfaces(
        _materials(surfaces, gains), _lights(light, rotation), _skin_texture(seed), facets
    )


def flicker_gains(light: Light, times_s: Array, exposure_s: float) -> Array:
    """What a swinging lamp gives rows exposed about n times, against its mean light; (n,).

    An exposure of whole periods sees none of it.
    """
    left = np.sinc(light.flicker_hz * exposure_s)
    swing = np.cos(2.0 * np.pi * light.flicker_hz * times_s)
    return np.asarray(1.0 + light.flicker * left * swing)


def _lights(light: Light, rotation: Array) -> Array:
    """(8, 3), unit directions to the lamps in the camera's frame."""
    lights = np.array(
        [
            light.key_from,
            light.key,
            light.fill_from,
            light.fill,
            light.rim_from,
            light.rim,
            light.ambient,
            (0.0, -1.0, 0.0),
        ]
    )
    for row in (KEY_DIRECTION, FILL_DIRECTION, RIM_DIRECTION, UP):
        lights[row] = rotation @ (lights[row] / np.linalg.norm(lights[row]))
    return lights


def _materials(surfaces: list[Surface], gains: Array) -> Array:
    """(m, 7): albedo as the camera sees it, gloss, shininess, texture, 1 for skin (the first)."""
    rows = [
        (*(np.array(s.albedo) * gains), s.gloss, s.shininess, s.texture, 1.0 if i == 0 else 0.0)
        for i, s in enumerate(surfaces)
    ]
    return np.array(rows)


def _skin_texture(seed: int) -> Array32:
    """Blotches (TEXELS, TEXELS) float32 that tile, mean 0, within about -1..1."""
    rng = np.random.default_rng([seed, 13])
    spectrum = np.fft.rfft2(rng.standard_normal((TEXELS, TEXELS)))
    fy, fx = np.fft.fftfreq(TEXELS)[:, None], np.fft.rfftfreq(TEXELS)[None]
    frequency = np.hypot(fx, fy)
    filtered = spectrum * np.exp(-((frequency / 0.16) ** 2)) / (frequency + 0.03)
    noise = np.fft.irfft2(filtered, (TEXELS, TEXELS))
    noise -= noise.mean()
    return (np.clip(0.45 * noise / noise.std(), -1.0, 1.0)).astype(np.float32)
