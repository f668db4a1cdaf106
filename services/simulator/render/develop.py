"""From light to the bytes of a camera: lens blur, gamma, YUV420 with averaged chroma, sensor noise.
Compiled kernels. Pure.

YUV is BT.601 with limited range, what cv2.COLOR_YUV2BGR_I420 undoes. A camera averages the chroma
of each 2x2 pixels; OpenCV's own BGR2YUV_I420 takes one of the four, which moves edges by half a
pixel.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

# The sRGB curve as a table over the square root of light: nearly a line, so 1024 steps are exact to
# 0.05 grey levels.
_STEPS = 1024
# Units of the noise bank per standard deviation; +-127 reaches 5.3 of them.
NOISE_UNIT = 24.0
# The bank is larger than the picture by this much each way: 64 x 64 even offsets, and each may be
# mirrored and negated.
_SPARE = 128
# Noise after gamma hardly depends on brightness: shot noise grows with the square root of light,
# the curve's slope falls about as fast; what remains is read noise in the shadows. Factor at black,
# and at white.
_DARK, _BRIGHT = 1.15, 0.85


def tone_curve() -> Array:
    """sRGB grey levels 0..255 over the square root of linear light 0..1; (_STEPS + 1,) float32."""
    light = np.linspace(0.0, 1.0, _STEPS + 1) ** 2
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return (255.0 * curve).astype(np.float32)


def blur_weights(sigma_px: float) -> Array:
    """Seven taps of a Gaussian, (7,) float32."""
    x = np.arange(-3, 4)
    weights = np.exp(-0.5 * (x / max(sigma_px, 1e-3)) ** 2)
    return (weights / weights.sum()).astype(np.float32)


def noise_bank(height: int, width: int, seed: int) -> tuple[Array, Array]:
    """Noise of Y (h + spare, w + spare) and of U and V (2, half of each) as int8, NOISE_UNIT to a
    grey level of RGB noise.

    White noise on a Bayer mosaic, interpolated bilinearly as cameras do (so neighbours are
    correlated, and averaging chroma helps less than it would), scaled so that each colour channel
    has a standard deviation of one.
    """
    rng = np.random.default_rng([seed, 17])
    h, w = height + _SPARE, width + _SPARE
    mosaic = rng.standard_normal((h, w))
    y, x = np.mgrid[:h, :w]
    masks = ((y % 2 == 0) & (x % 2 == 0), (y % 2) != (x % 2), (y % 2 == 1) & (x % 2 == 1))
    rgb = []
    for mask in masks:
        kernel = (1.0, 2.0, 1.0)
        channel, weight = _smooth(mosaic * mask, kernel), _smooth(mask.astype(float), kernel)
        channel /= weight
        rgb.append(channel / channel.std())
    r, g, b = rgb
    luma = 0.257 * r + 0.504 * g + 0.098 * b
    chroma = np.stack([-0.148 * r - 0.291 * g + 0.439 * b, 0.439 * r - 0.368 * g - 0.071 * b])
    chroma = chroma.reshape(2, h // 2, 2, w // 2, 2).mean(axis=(2, 4))
    return tuple(
        np.clip(np.round(NOISE_UNIT * plane), -127, 127).astype(np.int8) for plane in (luma, chroma)
    )


def _smooth(plane: Array, kernel: tuple[float, float, float]) -> Array:
    """Separable 3x3 filter that wraps round."""
    a, b, c = kernel
    plane = a * np.roll(plane, 1, 0) + b * plane + c * np.roll(plane, -1, 0)
    return a * np.roll(plane, 1, 1) + b * plane + c * np.roll(plane, -1, 1)


@njit(cache=True, nogil=True, fastmath=True)
def _blur_row(reach, weights, picture, scratch):  # type: ignore[no-untyped-def]
    """One row (w, 3), along the row; the three pixels at either end of the picture stay sharp."""
    width = picture.shape[0]
    first, last = max(reach[0], 3), min(reach[1], width - 4)
    for x in range(reach[0], min(3, reach[1] + 1)):
        for i in range(3):
            scratch[x, i] = picture[x, i]
    for x in range(max(width - 3, reach[0]), reach[1] + 1):
        for i in range(3):
            scratch[x, i] = picture[x, i]
    for x in range(first, last + 1):
        for i in range(3):
            scratch[x, i] = (
                weights[3] * picture[x, i]
                + weights[2] * (picture[x - 1, i] + picture[x + 1, i])
                + weights[1] * (picture[x - 2, i] + picture[x + 2, i])
                + weights[0] * (picture[x - 3, i] + picture[x + 3, i])
            )


@njit(cache=True, nogil=True, fastmath=True)
def blur(reach, weights, picture, scratch, out):  # type: ignore[no-untyped-def]
    """Separable blur of the picture (h, w, 3) into out, between the columns reach (h, 2) of each
    row, as `develop`.
    """
    height = picture.shape[0]
    wide = np.empty(2, np.int64)
    for y in range(height):
        # What this row's neighbours need of it.
        wide[0], wide[1] = picture.shape[1], -1
        for v in range(max(0, y - 3), min(height, y + 4)):
            if reach[v, 1] >= reach[v, 0]:
                wide[0], wide[1] = min(wide[0], reach[v, 0]), max(wide[1], reach[v, 1])
        _blur_row(wide, weights, picture[y], scratch[y])
    for y in range(height):
        inside = y >= 3 and y < height - 3
        for x in range(reach[y, 0], reach[y, 1] + 1):
            for i in range(3):
                if inside:
                    out[y, x, i] = (
                        weights[3] * scratch[y, x, i]
                        + weights[2] * (scratch[y - 1, x, i] + scratch[y + 1, x, i])
                        + weights[1] * (scratch[y - 2, x, i] + scratch[y + 2, x, i])
                        + weights[0] * (scratch[y - 3, x, i] + scratch[y + 3, x, i])
                    )
                else:
                    out[y, x, i] = scratch[y, x, i]


@njit(cache=True, nogil=True, inline="always")
def _tone(curve, light):  # type: ignore[no-untyped-def]
    return curve[int(math.sqrt(min(1.0, max(0.0, light))) * 1024.0 + 0.5)]


@njit(cache=True, nogil=True, fastmath=True)
def develop(reach, curve, picture, luma, chroma):  # type: ignore[no-untyped-def]
    """Light (h, w, 3) to Y (h, w), U and V (2, h / 2, w / 2), float32 unrounded, between the
    columns reach (h, 2) of each row.

    The two rows of a pair reach equally far, from an even to an odd column; an empty row ends
    before it begins.
    """
    for v in range(luma.shape[0] // 2):
        for w in range(reach[2 * v, 0] // 2, (reach[2 * v, 1] + 1) // 2):
            red, green, blue = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            for dy in range(2):
                for dx in range(2):
                    y, x = 2 * v + dy, 2 * w + dx
                    r, g, b = (
                        _tone(curve, picture[y, x, 0]),
                        _tone(curve, picture[y, x, 1]),
                        _tone(curve, picture[y, x, 2]),
                    )
                    luma[y, x] = (
                        np.float32(16.0)
                        + np.float32(0.257) * r
                        + np.float32(0.504) * g
                        + np.float32(0.098) * b
                    )
                    red, green, blue = red + r, green + g, blue + b
            chroma[0, v, w] = np.float32(128.0) + np.float32(0.25) * (
                np.float32(-0.148) * red - np.float32(0.291) * green + np.float32(0.439) * blue
            )
            chroma[1, v, w] = np.float32(128.0) + np.float32(0.25) * (
                np.float32(0.439) * red - np.float32(0.368) * green - np.float32(0.071) * blue
            )


def noise_offsets(seed: int, frame: int) -> tuple[int, int]:
    """Where in the bank a frame's noise begins; (rows, columns), both even."""
    state = np.random.SeedSequence([seed, frame]).generate_state(2)
    return 2 * int(state[0] % (_SPARE // 2)), 2 * int(state[1] % (_SPARE // 2))


@njit(cache=True, nogil=True, fastmath=True)
def expose(luma, chroma, luma_noise, chroma_noise, row, column, sign, strength, out):  # type: ignore[no-untyped-def]
    """Noise and rounding: I420 bytes (h * 3 / 2, w) of unrounded planes.

    strength: grey levels per unit of the bank; sign +1 or -1.
    """
    height, width = luma.shape
    slope = np.float32((_BRIGHT - _DARK) / 255.0 * strength * sign)
    base = np.float32(_DARK * strength * sign)
    half = np.float32(0.5)
    top = np.float32(255.0)
    for y in range(height):
        for x in range(width):
            value = luma[y, x]
            noisy = (
                value + np.float32(luma_noise[y + row, x + column]) * (base + slope * value) + half
            )
            out[y, x] = np.uint8(min(top, max(np.float32(0.0), noisy)))
    flat = out.reshape(-1)
    for plane in range(2):
        start = height * width + plane * (height // 2) * (width // 2)
        for y in range(height // 2):
            at = start + y * (width // 2)
            for x in range(width // 2):
                noise = np.float32(chroma_noise[plane, y + row // 2, x + column // 2])
                noisy = chroma[plane, y, x] + noise * (base + slope * luma[2 * y, 2 * x]) + half
                flat[at + x] = np.uint8(min(top, max(np.float32(0.0), noisy)))
