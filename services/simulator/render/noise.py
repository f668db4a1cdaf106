"""Sensor noise, and the rounding to bytes that follows it. Compiled kernels. Pure.

Noise comes from a bank that is larger than the picture. Each frame takes another part of it, as it
is or negated: fast, and the same for the same frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.render.develop import Planes

# Units of the noise bank per standard deviation; +-127 reaches 5.3 of them.
NOISE_UNIT = 24.0
# The bank is larger than the picture by this much each way: 64 x 64 even offsets.
_SPARE = 128
# Noise after gamma hardly depends on brightness: shot noise grows with the square root of light,
# the curve's slope falls about as fast; what remains is read noise in the shadows. Factor at black,
# and at white.
_DARK, _BRIGHT = 1.15, 0.85


class NoiseBank(NamedTuple):
    """Noise to take frames from, NOISE_UNIT to a grey level of RGB noise."""

    luma: npt.NDArray[np.int8]  # (h + spare, w + spare)
    chroma: npt.NDArray[np.int8]  # (2, (h + spare) / 2, (w + spare) / 2)


class NoiseDraw(NamedTuple):
    """Which part of the bank a frame takes, and how strong it is."""

    row: int  # even
    column: int  # even
    sign: float  # +1 or -1
    strength: float  # grey levels a unit of the bank

    def scaled(self, factor: float) -> NoiseDraw:
        """The same noise, stronger."""
        return self._replace(strength=self.strength * factor)


def noise_bank(height: int, width: int, seed: int) -> NoiseBank:
    """White noise on a Bayer mosaic, interpolated bilinearly as cameras do.

    So neighbours are correlated, and averaging chroma helps less than it would. Scaled so that each
    colour channel has a standard deviation of one grey level.
    """
    rng = np.random.default_rng([seed, 17])
    h, w = height + _SPARE, width + _SPARE
    mosaic = rng.standard_normal((h, w))
    y, x = np.mgrid[:h, :w]
    masks = ((y % 2 == 0) & (x % 2 == 0), (y % 2) != (x % 2), (y % 2 == 1) & (x % 2 == 1))
    rgb = []
    for mask in masks:
        channel, weight = _bilinear(mosaic * mask), _bilinear(mask.astype(float))
        channel /= weight
        rgb.append(channel / channel.std())
    r, g, b = rgb
    luma = 0.257 * r + 0.504 * g + 0.098 * b
    chroma = np.stack([-0.148 * r - 0.291 * g + 0.439 * b, 0.439 * r - 0.368 * g - 0.071 * b])
    chroma = chroma.reshape(2, h // 2, 2, w // 2, 2).mean(axis=(2, 4))
    return NoiseBank(_as_units(luma), _as_units(chroma))


def _bilinear(plane: Array) -> Array:
    """Separable 3x3 filter with weights 1, 2, 1 that wraps round."""
    a, b, c = 1.0, 2.0, 1.0
    plane = a * np.roll(plane, 1, 0) + b * plane + c * np.roll(plane, -1, 0)
    return a * np.roll(plane, 1, 1) + b * plane + c * np.roll(plane, -1, 1)


def _as_units(plane: Array) -> npt.NDArray[np.int8]:
    return np.clip(np.round(NOISE_UNIT * plane), -127, 127).astype(np.int8)


def draw_noise(seed: int, frame: int, sigma: float) -> NoiseDraw:
    """The noise of a frame, of `sigma` grey levels a colour channel at mid-grey."""
    row, column = noise_offsets(seed, frame)
    sign = 1.0 if (frame ^ (row >> 1)) & 1 else -1.0
    return NoiseDraw(row, column, sign, sigma / NOISE_UNIT)


def noise_offsets(seed: int, frame: int) -> tuple[int, int]:
    """Where in the bank a frame's noise begins; (row, column), both even."""
    state = np.random.SeedSequence([seed, frame]).generate_state(2)
    return 2 * int(state[0] % (_SPARE // 2)), 2 * int(state[1] % (_SPARE // 2))


@njit(cache=True, nogil=True, fastmath=True)
def add_noise(planes: Planes, bank: NoiseBank, draw: NoiseDraw, out: npt.NDArray[np.uint8]) -> None:
    """Add noise to the planes and round them to I420 bytes, out (h * 3 / 2, w)."""
    luma, chroma = planes.luma, planes.chroma
    row, column = draw.row, draw.column
    height, width = luma.shape
    slope = np.float32((_BRIGHT - _DARK) / 255.0 * draw.strength * draw.sign)
    base = np.float32(_DARK * draw.strength * draw.sign)
    half = np.float32(0.5)
    top = np.float32(255.0)
    for y in range(height):
        for x in range(width):
            value = luma[y, x]
            noise = np.float32(bank.luma[y + row, x + column])
            noisy = value + noise * (base + slope * value) + half
            out[y, x] = np.uint8(min(top, max(np.float32(0.0), noisy)))
    flat = out.reshape(-1)
    for plane in range(2):
        start = height * width + plane * (height // 2) * (width // 2)
        for y in range(height // 2):
            at = start + y * (width // 2)
            for x in range(width // 2):
                noise = np.float32(bank.chroma[plane, y + row // 2, x + column // 2])
                noisy = chroma[plane, y, x] + noise * (base + slope * luma[2 * y, 2 * x]) + half
                flat[at + x] = np.uint8(min(top, max(np.float32(0.0), noisy)))
