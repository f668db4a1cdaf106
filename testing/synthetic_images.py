"""Pictures with known ground truth: painted finger tips on skin before a wall.

With shading, blur, noise and 2x2 averaged chroma. For tests and benchmarks of pi_tracker alone;
whole hands in whole rooms are the simulator's. Pure: the same random seed gives the same picture. A
tip that reaches over the picture's edge is cut there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.image.frame import Frame, Image, Layout

Bgr = tuple[float, float, float]
# Paints that can be told apart, skin, and a grey wall, as a camera shows them in full light.
PAINTS: dict[str, Bgr] = {
    "green": (60, 150, 50),
    "blue": (190, 90, 30),
    "magenta": (140, 40, 190),
    "cyan": (190, 170, 40),
    "violet": (170, 50, 110),
    "lime": (40, 200, 150),
}
SKIN: Bgr = (120, 150, 200)
WALL: Bgr = (150, 152, 149)
# Places of six tips in a row, far enough apart not to touch.
ROW_X_PX: dict[str, float] = {name: 30.0 + 36.0 * number for number, name in enumerate(PAINTS)}
# Supersampling: edges are drawn so many times finer and averaged.
_SUPERSAMPLING = 6
# The part of its light that comes from all around: no side of a finger is black.
_AMBIENT = 0.15
# BT.601, rounded to four digits unlike yuv_planes.py: measured figures are with these.
_YUV_FROM_BGR = np.array(
    [[0.0979, 0.5041, 0.2568], [0.4392, -0.2910, -0.1482], [-0.0714, -0.3678, 0.4392]], np.float32
)


@dataclass(frozen=True)
class Tip:
    """A painted finger tip."""

    color: str
    # The middle of its paint, before shading and other tips.
    x_px: float
    y_px: float
    width_px: float = 9.0
    length_px: float = 10.0
    # The direction it points in, and the side the light comes from.
    turn_rad: float = 0.4
    light_rad: float = 0.3


def clean(
    tips: Sequence[Tip],
    size_px: tuple[int, int] = (64, 64),
    shading: float = 0.5,
    blur_px: float = 0.8,
    wall: Bgr | Image = WALL,
) -> tuple[Image, dict[str, tuple[float, float]]]:
    """The picture without noise, float32 BGR (h, w, 3), and each colour's centre, px.

    That is the centre of the visible paint, as if no other tip occluded it. shading 0 is flat
    light, 1 light from one direction only; blur_px is the standard deviation of the lens; a wall of
    several colours is an image (h, w, 3).
    """
    light = np.empty((size_px[1], size_px[0], 3), np.float32)
    light[:] = _linear_light(wall)
    truth = {tip.color: _draw(light, tip, shading) for tip in tips}
    # A lens blurs light, not grey levels.
    blurred = cv2.GaussianBlur(light, (0, 0), blur_px)
    return np.float32(255.0) * _srgb(blurred), truth


def _srgb(light: Image) -> Image:
    """Levels 0..1 of linear light 0..1, by the sRGB curve (IEC 61966-2-1)."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def noisy(image: Image, sigma: float, seed: int) -> Image:
    """With white sensor noise of sigma grey levels in each channel, as bytes."""
    noise = np.random.default_rng(seed).normal(0.0, sigma, image.shape)
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


def i420(bgr: Image, full_range: bool = False) -> Image:
    """YUV420 as a camera makes it, the chroma of 2x2 pixels averaged.

    (h, w, 3) -> (h * 3 / 2, w). full_range: Y in 0..255 instead of 16..235.
    """
    height, width = bgr.shape[:2]
    yuv = bgr.astype(np.float32) @ _YUV_FROM_BGR.T
    if full_range:
        yuv *= np.array([255 / 219, 255 / 224, 255 / 224], np.float32)
    yuv += np.array([0 if full_range else 16, 128, 128], np.float32)
    chroma = cv2.resize(yuv[..., 1:], (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    planes = np.concatenate([yuv[..., 0].ravel(), chroma[..., 0].ravel(), chroma[..., 1].ravel()])
    return np.clip(np.rint(planes), 0, 255).astype(np.uint8).reshape(height * 3 // 2, width)


def frame_of(
    bgr: Image,
    seq: int = 0,
    layout: Layout = "i420",
    fps: float = 30.0,
    full_range: bool = False,
) -> Frame:
    """A frame of a BGR image, number `seq` of a camera called "left"."""
    image = i420(bgr, full_range) if layout == "i420" else bgr
    stamp_ns = 1_700_000_000_000_000_000 + round(seq * 1e9 / fps)
    size_px = (bgr.shape[1], bgr.shape[0])
    return Frame("left", seq, stamp_ns, 30_000.0, size_px, image, layout, full_range)


def ranges() -> Colors:
    """HSV ranges of all paints."""
    return Colors(colors={name: _range(bgr) for name, bgr in PAINTS.items()})


def _range(bgr: Bgr) -> ColorRange:
    hue = int(cv2.cvtColor(np.array([[bgr]], np.uint8), cv2.COLOR_BGR2HSV)[0, 0, 0])
    return ColorRange(hsv_low=((hue - 10) % 180, 90, 30), hsv_high=((hue + 10) % 180, 255, 255))


def _linear_light(bgr: Bgr | Image) -> Image:
    """Linear light 0..1 of grey levels (..., 3), the inverse of _srgb."""
    levels = np.array(bgr) / 255.0
    return np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)


def _draw(image: Image, tip: Tip, shading: float) -> tuple[float, float]:
    """Draw a tip in linear light, sharp but anti-aliased; returns the centre of its paint.

    A cylinder that ends in a hemisphere, lit from one side and from all around.
    """
    reach = int(3.2 * tip.length_px + tip.width_px)
    x0, y0 = max(int(tip.x_px) - reach, 0), max(int(tip.y_px) - reach, 0)
    window = image[y0 : int(tip.y_px) + reach, x0 : int(tip.x_px) + reach]
    height, width = window.shape[:2]
    fine = window.repeat(_SUPERSAMPLING, 0).repeat(_SUPERSAMPLING, 1)
    rows = np.arange(height * _SUPERSAMPLING, dtype=np.float32)[:, None]
    columns = np.arange(width * _SUPERSAMPLING, dtype=np.float32)[None]
    x = (columns + 0.5) / _SUPERSAMPLING - 0.5 + x0 - tip.x_px
    y = (rows + 0.5) / _SUPERSAMPLING - 0.5 + y0 - tip.y_px
    c, s = np.cos(tip.turn_rad), np.sin(tip.turn_rad)
    along, across = x * c + y * s, -x * s + y * c
    radius, start = tip.width_px / 2, -tip.length_px / 2 + tip.width_px / 2
    from_axis, round_end = np.abs(across), along < start
    from_axis[round_end] = np.hypot(along[round_end] - start, across[round_end])
    finger = (from_axis < radius) & (along < 3 * tip.length_px)
    paint = finger & (along < tip.length_px / 2)
    facing = np.sqrt(np.clip(1 - (from_axis[finger] / radius) ** 2, 0, 1)) * np.cos(
        tip.light_rad
    ) + across[finger] / radius * np.sin(tip.light_rad)
    light = np.clip(1 - shading + shading * facing, _AMBIENT, 1.0)[:, None]
    painted = paint[finger][:, None]
    fine[finger] = np.where(painted, _linear_light(PAINTS[tip.color]), _linear_light(SKIN)) * light
    window[:] = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)
    x, y = (np.broadcast_to(one, paint.shape)[paint] for one in (x, y))
    return float(x.mean() + tip.x_px), float(y.mean() + tip.y_px)
