"""Which cells of a picture moved: other pictures show something else there. Pure.

The camera stands still, so a hand in motion is told from the things of a room, whatever their
colour. Cells count as alike by their chromaticity, as in region_growing.py: a hand's shadow on a
thing is no motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.chroma import DARK_LUMA, Cells, Mask

Plane = npt.NDArray[np.float32]

# Two colours are alike if one's chroma across the other's direction is this share of that along it
# at most, and along it within these shares of what the other's would be in that light; with so many
# grey levels of noise in the mean of nine cells. Shares as in region_growing.py, noise set by hand.
_MAX_ACROSS, _MIN_ALONG, _MAX_ALONG, _NOISE = 0.30, 0.40, 2.2, 4.0


class _Smooth(NamedTuple):
    """A picture's cells, each the mean of nine."""

    y: Plane
    u: Plane
    v: Plane


def moved_shares(pictures: Sequence[Cells]) -> list[Plane]:
    """Of each picture and cell (h, w), the share of the others that have another colour there.

    Zero where there are no others.
    """
    smooth = [_Smooth(*(_blurred(plane) for plane in (p.y, p.u, p.v))) for p in pictures]
    found = []
    for picture in smooth:
        apart = np.zeros(picture.y.shape, np.float32)
        for other in smooth:
            if other is not picture:
                apart += ~_alike(picture, other)
        found.append(apart / np.float32(max(len(smooth) - 1, 1)))
    return found


def _blurred(plane: npt.NDArray[np.float64]) -> Plane:
    return np.asarray(cv2.blur(plane.astype(np.float32), (3, 3)))


def _alike(picture: _Smooth, other: _Smooth) -> Mask:
    """Where another picture has the colour that this one has there."""
    strength = np.maximum(np.hypot(picture.u, picture.v), 1e-3)
    along = (other.u * picture.u + other.v * picture.v) / strength
    across = np.abs(other.v * picture.u - other.u * picture.v) / strength
    light = np.maximum(other.y, DARK_LUMA) / np.maximum(picture.y, DARK_LUMA)
    return np.asarray(
        (across <= _MAX_ACROSS * np.maximum(along, 0.0) + _NOISE)
        & (along >= _MIN_ALONG * strength * light - _NOISE)
        & (along <= _MAX_ALONG * strength * light + _NOISE)
    )
