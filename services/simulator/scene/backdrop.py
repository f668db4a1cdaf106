"""The background behind the hand: a textured wall, a table's edge, objects of many colours.
Rendered once for each camera. Pure.

The wall is a plane in the frame of the first camera, so every camera sees the same one with its own
parallax. Colours are linear RGB. Clutter adds saturated objects in the same hues as the paints.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, inverse
from services.simulator.scene.paints import PAINTS, Rgb

Light32 = npt.NDArray[np.float32]

# Distance of the wall from the rig's first camera, and texels per metre: 2 mm, finer than a pixel
# there.
_WALL_M, _TEXELS_PER_METRE = 1.25, 500.0
# Texels along either side of the wall.
_SIDE = 1400
# Pale plaster, a wooden table, and objects: muted colours as rooms have them, none with the
# saturation of paint.
_PLASTER: Rgb = (0.44, 0.42, 0.38)
_WOOD: Rgb = (0.26, 0.15, 0.085)
_MUTED: tuple[Rgb, ...] = (
    (0.30, 0.13, 0.07),
    (0.45, 0.32, 0.10),
    (0.09, 0.10, 0.12),
    (0.32, 0.34, 0.37),
    (0.12, 0.16, 0.10),
    (0.50, 0.47, 0.44),
    (0.18, 0.22, 0.28),
    (0.36, 0.06, 0.05),
    (0.24, 0.19, 0.22),
)
_SATURATED = ("magenta", "blue", "green", "violet", "lime", "cyan", "red", "orange")


# A scene's cameras see one wall, whose texture takes as long as a third of a camera's start.
@lru_cache(maxsize=1)
def wall_texture(seed: int, clutter: bool) -> Light32:
    """Light that the wall sends back, (_SIDE, _SIDE, 3) linear RGB; read-only."""
    rng = np.random.default_rng([seed, 19])
    size = (_SIDE, _SIDE)
    texture = np.empty((*size, 3), np.float32)
    texture[:] = _PLASTER
    # The table begins a hand's breadth below the middle.
    table = _SIDE // 2 + 120
    grain = cv2.resize(
        rng.standard_normal((_SIDE // 3, 9), np.float32), size[::-1], interpolation=cv2.INTER_CUBIC
    )
    texture[table:] = np.array(_WOOD, np.float32) * (1.0 + 0.22 * grain[table:, :, None])
    for colour in (*_MUTED, *_MUTED):
        _draw_object(texture, rng, np.array(colour), rng.uniform(30, 150, 2))
    if clutter:
        for name in (*_SATURATED, *_SATURATED):
            _draw_object(
                texture,
                rng,
                np.array(PAINTS[name]) * rng.uniform(0.55, 0.95),
                rng.uniform(8, 34, 2),
            )
    texture *= 1.0 + 0.10 * _fractal_noise(rng, size)[..., None]
    texture *= 1.0 + 0.05 * rng.standard_normal((*size, 1), np.float32)
    light: Light32 = np.clip(cv2.GaussianBlur(texture, (0, 0), 1.2), 0.004, 1.0)
    light.setflags(write=False)
    return light


def _draw_object(texture: Light32, rng: np.random.Generator, colour: Array, half: Array) -> None:
    """A box or disc somewhere on the wall, lit from one side, with a stripe of another tone.

    half (2,) is its half width and height in texels.
    """
    # The cameras see the middle half.
    x, y = rng.uniform(0.22, 0.78, 2) * _SIDE
    mask = np.zeros(texture.shape[:2], np.uint8)
    angle = float(rng.uniform(-12, 12))
    if rng.random() < 0.35:
        cv2.circle(mask, (int(x), int(y)), int(half.min()), 1, -1)
    else:
        corners = cv2.boxPoints(
            ((float(x), float(y)), (2.0 * float(half[0]), 2.0 * float(half[1])), angle)
        )
        cv2.fillConvexPoly(mask, corners.astype(np.int32), 1)
    # Searched no farther than the object reaches.
    reach = float(np.hypot(*half)) + 2.0
    top, left = max(0, int(y - reach)), max(0, int(x - reach))
    rows, columns = np.nonzero(mask[top : int(y + reach) + 1, left : int(x + reach) + 1])
    rows, columns = rows + top, columns + left
    side = (columns - x) / (2.0 * half[0])
    stripe = 1.0 + 0.35 * (np.sin((rows - y) * 40.0 / half[1] * 0.2) > 0.6)
    texture[rows, columns] = colour * (0.85 - 0.3 * side[:, None]) * stripe[:, None]


def _fractal_noise(rng: np.random.Generator, size: tuple[int, int]) -> Light32:
    """Smooth noise of several octaves, standard deviation about 1."""
    total = np.zeros(size, np.float32)
    for cells, weight in ((4, 0.6), (11, 0.5), (37, 0.45), (120, 0.4)):
        total += weight * cv2.resize(
            rng.standard_normal((cells, cells), np.float32),
            size[::-1],
            interpolation=cv2.INTER_CUBIC,
        )
    return total


def backdrop(camera: Camera, first: Camera, wall: Light32, rays: Light32, gains: Array) -> Light32:
    """The wall as one camera sees it, sharp, without vignetting; (h, w, 3) linear RGB.

    wall is its texture, rays (h, 3, w) the camera's pixel rays, gains (3,) its colour gains.
    """
    T_first_from_camera = inverse(first.T_rig_from_camera) @ camera.T_rig_from_camera
    direction = rays.transpose(0, 2, 1).astype(np.float64) @ T_first_from_camera[:3, :3].T
    origin = T_first_from_camera[:3, 3]
    distance = (_WALL_M - origin[2]) / np.maximum(direction[..., 2], 1e-3)
    x = (origin[0] + distance * direction[..., 0]) * _TEXELS_PER_METRE + _SIDE / 2
    y = (origin[1] + distance * direction[..., 1]) * _TEXELS_PER_METRE + _SIDE / 2
    seen = cv2.remap(
        wall,
        x.astype(np.float32),
        y.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REFLECT,
    )
    return (seen * gains).astype(np.float32)


def vignette(rays: Light32) -> Light32:
    """Share of the light that reaches each pixel, (h, w).

    Three quarters of the natural vignetting of a simple lens, cos^4 of the angle to the axis.
    """
    return (rays[:, 2].astype(np.float64) ** 4 * 0.75 + 0.25).astype(np.float32)
