"""Skin under light: pores, wrinkles at the joints, blood beneath, paint and dots on it.

Made to be hard where real hands are: wrinkles and folds are edges that are no outline, light from
one side makes one outline strong and the other weak, and the palm behind has the finger's colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.scene.flesh import Field
from studies.grasp.scene.view import Picture

# The texture tiles: 512 texels of 1/6 mm, finer than a pixel of these pictures.
_TEXELS, _TEXELS_PER_MM = 512, 6.0
# Wrinkles about a joint, mm from its axis: on the back three to four, in the palm a deep one.
_BACK_MM, _PALM_MM = (-3.4, -1.3, 0.7, 2.6), (-0.8, 0.5)
_PROFILE_MM, _PROFILE_STEPS = 6.0, 20.0


class Light(NamedTuple):
    """From where it comes (x, y, towards the camera), and how much comes from everywhere."""

    direction: tuple[float, float, float] = (-0.5, -0.62, 0.6)
    ambient: float = 0.45


class Wrinkles(NamedTuple):
    """Where joints are along the limb (mm), how far each is bent (rad), how deep they look."""

    along: tuple[float, ...] = ()
    bent: tuple[float, ...] = ()
    depth: float = 1.0


@lru_cache(maxsize=2)
def grain(seed: int) -> Picture:
    """A tiling texture (n, n) about 0, RMS 1: from pores to blotches."""
    rng = np.random.default_rng((seed, 3))
    waves = np.fft.rfft2(rng.standard_normal((_TEXELS, _TEXELS)))
    hz = np.hypot(np.fft.fftfreq(_TEXELS)[:, None], np.fft.rfftfreq(_TEXELS))
    # Four sizes of equal strength, as sums of Gaussian blurs have them; blurs of tiles wrap.
    sizes = [sigma * np.exp(-2.0 * (np.pi * sigma * hz) ** 2) for sigma in (1.0, 3.0, 9.0, 27.0)]
    whole = np.fft.irfft2(waves * np.sum(sizes, axis=0) * (hz > 0.0), s=(_TEXELS, _TEXELS))
    return np.ascontiguousarray(whole / whole.std(), dtype=np.float32)


def textured(x_mm: Picture, y_mm: Picture, per_mm: float, seed: int, kind: int) -> Picture:
    """The grain at places in mm (h, w); each kind of surface has another part of it."""
    # 137 and 61: no two of a dozen kinds come close to each other.
    at_x = np.float32(per_mm) * x_mm + np.float32(137.0 * kind)
    at_y = np.float32(per_mm) * y_mm + np.float32(61.0 * kind)
    seen = cv2.remap(grain(seed), at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(seen, dtype=np.float32)


def blurred(picture: Picture, sigma_px: float) -> Picture:
    """A Gaussian blur."""
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma_px), dtype=np.float32)


def skin_albedo(
    field: Field, colour: Sequence[float], wrinkles: Wrinkles, seed: int, kind: int
) -> Picture:
    """What the skin reflects (3, h, w), blue, green, red."""
    pores = textured(field.along, field.across, _TEXELS_PER_MM, seed, kind)
    dark = np.float32(1.0) + np.float32(0.035) * pores
    side = np.clip(field.across / field.radius, -1.0, 1.0)  # -1 back .. 1 palm
    for where, bent in zip(wrinkles.along, wrinkles.bent, strict=True):
        # Wrinkles are not drawn with a ruler.
        offset = field.along - np.float32(where) + np.float32(0.35) * pores
        near = np.flatnonzero((np.abs(offset) < _PROFILE_MM) & (field.distance < 1.0))
        step = ((offset.flat[near] + _PROFILE_MM) * _PROFILE_STEPS).astype(np.int32)
        back, palm = (profile.take(step, mode="clip") for profile in _profiles())
        # The back's skin is stretched flat by bending, the palm's folded.
        share = min(max(float(bent) / 1.7, 0.0), 1.0)
        there = side.flat[near]
        back *= np.clip(-1.5 * there - 0.15, 0.0, 1.0) * (wrinkles.depth * (1.0 - 0.8 * share))
        palm *= np.clip(1.6 * there - 0.2, 0.0, 1.0) * (wrinkles.depth * (0.5 + 0.5 * share))
        dark.flat[near] *= 1.0 - back - palm
    dark *= 1.0 - np.float32(0.35) * field.fold
    albedo = np.asarray(colour, dtype=np.float32)[:, None, None] * dark
    # Palms are paler and redder than backs.
    albedo[2] *= 1.0 + np.float32(0.04) * side
    return albedo


@lru_cache(maxsize=1)
def _profiles() -> Picture:
    """How dark wrinkles of the back and of the palm are, by distance from the joint; (2, n)."""
    at = np.arange(-_PROFILE_MM, _PROFILE_MM, 1.0 / _PROFILE_STEPS)
    back = sum(
        depth * np.exp(-0.5 * ((at - centre) / 0.32) ** 2)
        for centre, depth in zip(_BACK_MM, (0.16, 0.24, 0.27, 0.15), strict=True)
    )
    palm = sum(
        depth * np.exp(-0.5 * ((at - centre) / 0.4) ** 2)
        for centre, depth in zip(_PALM_MM, (0.34, 0.2), strict=True)
    )
    return np.stack([back, palm]).astype(np.float32)


def shade(field: Field, albedo: Picture, light: Light, gloss: float = 0.05) -> Picture:
    """A round limb under the light; (3, h, w), 0..1. The picture's axes are the light's."""
    dx = cv2.Sobel(field.distance, cv2.CV_32F, 1, 0, ksize=3)
    dy = cv2.Sobel(field.distance, cv2.CV_32F, 0, 1, ksize=3)
    size = np.sqrt(dx * dx + dy * dy) + np.float32(1e-6)
    # A finger is flatter than a cylinder in its middle.
    out = np.clip(1.0 + field.distance / field.radius, 0.0, 1.0)
    out *= np.sqrt(out)
    towards = np.asarray(light.direction, dtype=np.float32)
    towards /= np.linalg.norm(towards)
    facing = np.sqrt(1.0 - np.minimum(out, 0.999) ** 2)
    lit = (dx * towards[0] + dy * towards[1]) * (out / size) + facing * towards[2]
    level = np.float32(light.ambient) * (np.float32(0.75) + np.float32(0.25) * facing)
    lit = np.clip(lit, 0.0, 1.0)
    level += np.float32(1.15 * (1.0 - light.ambient)) * lit
    fourth = np.square(np.square(lit))
    return albedo * level + np.float32(gloss) * fourth * fourth * fourth


def cover(distance: Picture, mm_per_px: Picture) -> Picture:
    """How much of each pixel lies inside, from the distance to the edge in mm."""
    return np.clip(np.float32(0.5) - distance / mm_per_px, 0.0, 1.0)


def painted(
    albedo: Picture,
    x: Picture,
    y: Picture,
    dots: Array,
    radius_mm: float,
    colour: tuple[float, float, float],
    mm_per_px: Picture,
) -> None:
    """Paints dots (n, 2) onto the albedo, by hand: a little uneven. In place."""
    for number, (cx, cy) in enumerate(dots):
        dx, dy = x - np.float32(cx), y - np.float32(cy)
        reach = float(radius_mm) + 2.0
        near = (np.abs(dx) < reach) & (np.abs(dy) < reach)
        if not near.any():
            continue
        rows, columns = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
        box = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        dx, dy = dx[box], dy[box]
        angle = np.arctan2(dy, dx)
        edge = radius_mm * (1.0 + 0.07 * np.sin(2.0 * angle + number) + 0.04 * np.cos(5.0 * angle))
        share = cover((np.hypot(dx, dy) - edge).astype(np.float32), mm_per_px[box])
        # Paint is thin: the skin's grain shows through.
        skin = albedo[:, box[0], box[1]]
        paint = np.asarray(colour, dtype=np.float32)[:, None, None] * (0.85 + 0.3 * skin.mean(0))
        skin += np.float32(0.92) * share * (paint - skin)
