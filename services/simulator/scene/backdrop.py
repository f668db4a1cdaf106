"""What stands behind the hand: a textured wall, a table's edge, things of many colours. Rendered
once a camera. Pure.

The wall is a plane in the frame of the first camera, so every camera sees the same one with its own
parallax. Colours are linear RGB. The cluttered backdrop adds saturated things in the very hues of
the paints.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, inverse
from services.simulator.scene.paints import PAINTS, Rgb

Light32 = npt.NDArray[np.float32]

# Distance of the wall behind the rig's first camera, and texels per metre: 2 mm, finer than a pixel
# there.
_WALL_M, _PER_METRE = 1.25, 500.0
_SIDE = 1400
# Pale plaster, a wooden table, and what lies about: muted colours as rooms have them, none with the
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


def wall(seed: int, clutter: bool) -> Light32:
    """The wall's picture (_SIDE, _SIDE, 3), linear RGB, as lit."""
    rng = np.random.default_rng([seed, 19])
    size = (_SIDE, _SIDE)
    picture = np.empty((*size, 3), np.float32)
    picture[:] = _PLASTER
    # The table begins a hand's breadth below the middle.
    table = _SIDE // 2 + 120
    grain = cv2.resize(
        rng.standard_normal((_SIDE // 3, 9), np.float32), size[::-1], interpolation=cv2.INTER_CUBIC
    )
    picture[table:] = np.array(_WOOD, np.float32) * (1.0 + 0.22 * grain[table:, :, None])
    for colour in (*_MUTED, *_MUTED):
        _thing(picture, rng, np.array(colour), rng.uniform(30, 150, 2))
    if clutter:
        for name in (*_SATURATED, *_SATURATED):
            _thing(
                picture,
                rng,
                np.array(PAINTS[name]) * rng.uniform(0.55, 0.95),
                rng.uniform(8, 34, 2),
            )
    picture *= 1.0 + 0.10 * _clouds(rng, size)[..., None]
    picture *= 1.0 + 0.05 * rng.standard_normal((*size, 1), np.float32)
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 1.2), 0.004, 1.0)


def _thing(picture: Light32, rng: np.random.Generator, colour: Array, half: Array) -> None:
    """A box or disc somewhere on the wall, lit from one side, with a stripe of another tone."""
    # The cameras see the middle half.
    x, y = rng.uniform(0.22, 0.78, 2) * _SIDE
    mask = np.zeros(picture.shape[:2], np.uint8)
    angle = float(rng.uniform(-12, 12))
    if rng.random() < 0.35:
        cv2.circle(mask, (int(x), int(y)), int(half.min()), 1, -1)
    else:
        corners = cv2.boxPoints(
            ((float(x), float(y)), (2.0 * float(half[0]), 2.0 * float(half[1])), angle)
        )
        cv2.fillConvexPoly(mask, corners.astype(np.int32), 1)
    rows, columns = np.nonzero(mask)
    side = (columns - x) / (2.0 * half[0])
    stripe = 1.0 + 0.35 * (np.sin((rows - y) * 40.0 / half[1] * 0.2) > 0.6)
    picture[rows, columns] = colour * (0.85 - 0.3 * side[:, None]) * stripe[:, None]


def _clouds(rng: np.random.Generator, size: tuple[int, int]) -> Light32:
    """Smooth noise of several octaves, standard deviation about 1."""
    total = np.zeros(size, np.float32)
    for cells, weight in ((4, 0.6), (11, 0.5), (37, 0.45), (120, 0.4)):
        total += weight * cv2.resize(
            rng.standard_normal((cells, cells), np.float32),
            size[::-1],
            interpolation=cv2.INTER_CUBIC,
        )
    return total


def backdrop(
    camera: Camera, first: Camera, picture: Light32, rays: Light32, gains: Array
) -> Light32:
    """The wall as one camera sees it, sharp, without vignetting; (h, w, 3) linear RGB.

    gains (3,) are the camera's colour gains.
    """
    T_first_from_camera = inverse(first.T_rig_from_camera) @ camera.T_rig_from_camera
    direction = rays.transpose(0, 2, 1).astype(np.float64) @ T_first_from_camera[:3, :3].T
    origin = T_first_from_camera[:3, 3]
    reach = (_WALL_M - origin[2]) / np.maximum(direction[..., 2], 1e-3)
    x = (origin[0] + reach * direction[..., 0]) * _PER_METRE + _SIDE / 2
    y = (origin[1] + reach * direction[..., 1]) * _PER_METRE + _SIDE / 2
    seen = cv2.remap(
        picture,
        x.astype(np.float32),
        y.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REFLECT,
    )
    return (seen * gains).astype(np.float32)


def vignette(rays: Light32) -> Light32:
    """How much of the light reaches each pixel: cos^4 of the angle to the axis, as of a simple
    lens; (h, w).
    """
    return (rays[:, 2].astype(np.float64) ** 4 * 0.75 + 0.25).astype(np.float32)
