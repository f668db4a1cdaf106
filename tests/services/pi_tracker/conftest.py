"""Pictures with a known truth: painted finger tips on skin before a wall, with shading, blur, noise and 2x2 averaged chroma."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from rhot.calibration import ColorRange, Colors
from rhot.config import Tracker
from services.pi_tracker.colors import compile_colors
from services.pi_tracker.frame import Frame
from services.pi_tracker.noise import Noise
from services.pi_tracker.search import Searcher

# BGR paints, and HSV ranges around them.
PAINTS = {
    "green": (60, 150, 50),
    "blue": (190, 90, 30),
    "magenta": (140, 40, 190),
    "cyan": (190, 170, 40),
    "violet": (170, 50, 110),
    "lime": (40, 200, 150),
}
SKIN, WALL = (120, 150, 200), (150, 152, 149)
_FINE = 6


@dataclass(frozen=True)
class Tip:
    """A painted finger tip: its middle, width and length in px, direction in rad, side the light comes from."""

    color: str
    x_px: float
    y_px: float
    width_px: float = 9.0
    length_px: float = 10.0
    turn_rad: float = 0.4
    light: float = 0.3


def _draw(image: np.ndarray, tip: Tip, shading: float) -> tuple[float, float]:
    """Draw a tip on a picture, sharp but anti-aliased; returns the centre of its paint."""
    reach = int(3.2 * tip.length_px + tip.width_px)
    x0, y0 = max(int(tip.x_px) - reach, 0), max(int(tip.y_px) - reach, 0)
    window = image[y0 : int(tip.y_px) + reach, x0 : int(tip.x_px) + reach]
    height, width = window.shape[:2]
    fine = window.repeat(_FINE, 0).repeat(_FINE, 1)
    rows, columns = np.mgrid[: height * _FINE, : width * _FINE].astype(np.float32)
    x, y = (columns + 0.5) / _FINE - 0.5 + x0 - tip.x_px, (rows + 0.5) / _FINE - 0.5 + y0 - tip.y_px
    c, s = np.cos(tip.turn_rad), np.sin(tip.turn_rad)
    along, across = x * c + y * s, -x * s + y * c
    radius, start = tip.width_px / 2, -tip.length_px / 2 + tip.width_px / 2
    away = np.where(along < start, np.hypot(along - start, across), np.abs(across))
    finger = (away < radius) & (along < 3 * tip.length_px)
    paint = finger & (along < tip.length_px / 2)
    facing = np.sqrt(np.clip(1 - (away / radius) ** 2, 0, 1)) * np.cos(tip.light) + across / radius * np.sin(tip.light)
    light = np.clip(1 - shading + shading * facing, 0.15, 1.0)[..., None]
    fine[finger] = (np.array(SKIN) * light)[finger]
    fine[paint] = (np.array(PAINTS[tip.color]) * light)[paint]
    window[:] = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)
    return float(x[paint].mean() + tip.x_px), float(y[paint].mean() + tip.y_px)


class Studio:
    """Takes pictures of finger tips."""

    paints = PAINTS

    @staticmethod
    def clean(tips, size_px=(64, 64), shading=0.5, blur_px=0.8, wall=WALL):
        """The picture without noise, float BGR (h, w, 3), and the centre of the paint of each colour."""
        image = np.empty((size_px[1], size_px[0], 3), np.float32)
        image[:] = wall
        truth = {tip.color: _draw(image, tip, shading) for tip in tips}
        return cv2.GaussianBlur(image, (0, 0), blur_px), truth

    @staticmethod
    def bgr(clean, sigma, seed):
        """With sensor noise, rounded to bytes."""
        rng = np.random.default_rng(seed)
        return np.clip(np.rint(clean + rng.normal(0, sigma, clean.shape)), 0, 255).astype(np.uint8)

    @staticmethod
    def i420(bgr):
        """YUV420 as a camera makes it: the chroma of 2x2 pixels averaged."""
        height, width = bgr.shape[:2]
        weights = np.array([[0.0979, 0.5041, 0.2568], [0.4392, -0.2910, -0.1482], [-0.0714, -0.3678, 0.4392]], np.float32)
        yuv = bgr.astype(np.float32) @ weights.T + np.array([16, 128, 128], np.float32)
        chroma = cv2.resize(yuv[..., 1:], (width // 2, height // 2), interpolation=cv2.INTER_AREA)
        planes = [yuv[..., 0].ravel(), chroma[..., 0].ravel(), chroma[..., 1].ravel()]
        return np.clip(np.rint(np.concatenate(planes)), 0, 255).astype(np.uint8).reshape(height * 3 // 2, width)

    def frame(self, tips, seq=0, layout="i420", sigma=5.0, size_px=(64, 64), fps=30.0, **look):
        """A noisy frame and the truth."""
        clean, truth = self.clean(tips, size_px, **look)
        return self.of(self.bgr(clean, sigma, seq), seq, layout, fps), truth

    def of(self, bgr, seq=0, layout="i420", fps=30.0):
        """A frame of a BGR image."""
        image = self.i420(bgr) if layout == "i420" else bgr
        stamp_ns = 1_700_000_000_000_000_000 + round(seq * 1e9 / fps)
        return Frame("left", seq, stamp_ns, 30_000.0, (bgr.shape[1], bgr.shape[0]), image, layout)


def _range(bgr) -> ColorRange:
    hue = int(cv2.cvtColor(np.uint8([[bgr]]), cv2.COLOR_BGR2HSV)[0, 0, 0])
    return ColorRange(hsv_low=((hue - 10) % 180, 90, 30), hsv_high=((hue + 10) % 180, 255, 255))


@pytest.fixture(scope="session")
def studio() -> Studio:
    """Makes pictures."""
    return Studio()


@pytest.fixture(scope="session")
def tip():
    """The class of painted finger tips."""
    return Tip


@pytest.fixture(scope="session")
def colors() -> Colors:
    """Ranges of all paints."""
    return Colors(colors={name: _range(bgr) for name, bgr in PAINTS.items()})


@pytest.fixture(scope="session")
def searcher(colors) -> Searcher:
    """A searcher for all paints, in the order of PAINTS, with the default settings."""
    return Searcher(compile_colors(colors, list(PAINTS)), Tracker())


@pytest.fixture
def noise() -> Noise:
    """Noise of cells where pixels have 5 grey levels."""
    return Noise(1.44, 1.47)
