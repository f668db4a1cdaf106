"""Dots without a colour, as the paper's black ones: darker, or lighter, than the skin around. Pure.

Their size and contrast are learned at the seeds; then a top-hat transform takes away everything
that is larger (Serra, Image Analysis and Mathematical Morphology, 1982).
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from services.pi_tracker.dots.dot import Dot, Patch
from services.pi_tracker.dots.tracker import DotTracker
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import bgr_image
from studies.grasp.measure.seeds import Seeds

# Radii that are tried, px.
_RADII_PX = np.geomspace(2.0, 40.0, 16)
# Grey levels by which a dot stands out at least; a pencil's on dark skin.
_LEAST_CONTRAST = 12.0
# Half the side of the square that takes a dot away, and leaves what is larger, in radii of a dot:
# little more than 1, so that dark gaps beside it stay out.
_KERNEL_RADII = 1.25
# A patch stands out by this share of the dots at the seeds, and has this many times their area.
_CONTRAST_SHARE, _AREAS = 0.5, (0.3, 3.0)
# Of its box a disc fills .79; hair and folds fill less than this, and are longer than wide.
_LEAST_FILL, _MAX_ASPECT = 0.5, 2.5
# A dot seen in part, or blurred, is off by this share of its diameter.
_SIGMA_SHARE, _LEAST_SIGMA_PX = 0.02, 0.15


class InkPatches:
    """Finds patches like those at the seeds of the first picture."""

    def __init__(self, first: Frame, seeds: Seeds) -> None:
        grey = _grey(first)
        responses = np.array([_responses(grey, at) for at in seeds.values()])  # (n, r)
        middle = np.median(responses, axis=0)
        best = int(np.argmax(np.abs(middle)))
        self.radius_px = float(_RADII_PX[best])
        self._dark = bool(middle[best] > 0.0)
        heights = self._hat(grey)
        tops = [
            float(_around(heights, at, max(1, round(0.5 * self.radius_px))).max())
            for at in seeds.values()
        ]
        self.contrast = float(np.median(tops))
        self.stands_out = self.contrast >= _LEAST_CONTRAST

    def find(self, frame: Frame) -> list[Patch]:
        """All patches of one picture."""
        heights = self._hat(_grey(frame))
        mask = (heights > _CONTRAST_SHARE * self.contrast).astype(np.uint8)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
        usual_px2 = math.pi * self.radius_px**2
        found = []
        for label in range(1, count):
            x, y, width, height, area = (int(value) for value in stats[label])
            if not _AREAS[0] * usual_px2 <= area <= _AREAS[1] * usual_px2:
                continue
            if max(width, height) > _MAX_ASPECT * min(width, height):
                continue
            if area < _LEAST_FILL * width * height:
                continue
            own = labels[y : y + height, x : x + width] == label
            weight = np.where(own, heights[y : y + height, x : x + width], 0.0)
            rows, columns = np.mgrid[y : y + height, x : x + width]
            total = float(weight.sum())
            sigma = max(_LEAST_SIGMA_PX, _SIGMA_SHARE * 2.0 * math.sqrt(area / math.pi))
            found.append(
                Patch(
                    float((columns * weight).sum()) / total,
                    float((rows * weight).sum()) / total,
                    float(area),
                    sigma,
                )
            )
        return found

    def _hat(self, grey: Image) -> Image:
        """By how much each pixel stands out from what is larger than a dot; (h, w)."""
        side = 2 * math.ceil(_KERNEL_RADII * self.radius_px) + 1
        kernel = np.ones((side, side), np.uint8)
        kind = cv2.MORPH_BLACKHAT if self._dark else cv2.MORPH_TOPHAT
        return cv2.morphologyEx(grey, kind, kernel).astype(np.float32)


class InkFinder:
    """Follows dots without a colour, as services/pi_tracker/dots does coloured ones."""

    def __init__(self, patches: InkPatches, tracker: DotTracker) -> None:
        self._patches, self._tracker = patches, tracker

    def find(self, frame: Frame) -> dict[str, Dot]:
        """The dots of one picture by landmark."""
        return self._tracker.step(self._patches.find(frame), 1e-9 * frame.stamp_ns)


def _grey(frame: Frame) -> Image:
    return cv2.GaussianBlur(cv2.cvtColor(bgr_image(frame), cv2.COLOR_BGR2GRAY), (0, 0), 0.8)


def _responses(grey: Image, at: tuple[float, float]) -> np.ndarray:
    """How much darker a disc of each radius is than a ring of as much area around it; (r,)."""
    found = []
    for radius in _RADII_PX:
        part = _around(grey, at, math.ceil(1.5 * radius)).astype(np.float64)
        half = (np.array(part.shape) - 1) / 2.0
        rows, columns = np.mgrid[0 : part.shape[0], 0 : part.shape[1]]
        apart = np.hypot(rows - half[0], columns - half[1])
        inner, ring = apart <= radius, (apart > 1.05 * radius) & (apart <= 1.45 * radius)
        step = float(part[ring].mean() - part[inner].mean()) if ring.any() else 0.0
        found.append(step)
    return np.array(found)


def _around(image: Image, at: tuple[float, float], reach: int) -> Image:
    """The square of pixels about a place, cut at the picture's edge."""
    x, y = round(at[0]), round(at[1])
    return image[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1]
