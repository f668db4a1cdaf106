"""A plane's picture as seen squarely, so many pixels a millimetre. Lens and plane in one go."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from studies.grasp.metrology.plane import Plane, project
from studies.grasp.metrology.segments import homogeneous, inverted

# A rectified picture is wider than no camera's, and shows no more of the plane than this many times
# the reference beyond it: towards the horizon a plane is endless.
_LARGEST_PX, _BEYOND = 4096, 4.0


class Raster(NamedTuple):
    """size_px; px_per_mm; corner_mm (2,): the plane's point at the upper left pixel."""

    size_px: tuple[int, int]
    px_per_mm: float
    corner_mm: Array

    def places_mm(self) -> Array:
        """Of each pixel; (h w, 2)."""
        width, height = self.size_px
        rows, columns = np.mgrid[0:height, 0:width]
        return self.corner_mm + np.stack([columns.ravel(), rows.ravel()], axis=1) / self.px_per_mm


def raster_of(
    plane: Plane, size_px: tuple[int, int], about_px: Array, px_per_mm: float | None = None
) -> Raster:
    """What of the plane a picture shows, about a reference (n, 2) px; as fine as the reference is
    in the picture unless px_per_mm says otherwise.
    """
    about = plane.to_mm(about_px)
    low, high = about.min(axis=0), about.max(axis=0)
    reach = _BEYOND * max(float((high - low).max()), 1.0)
    seen = _border(size_px)
    # Beyond the horizon a plane's points have the other sign.
    back = inverted(plane.image_from_plane)[2]
    side = (homogeneous(seen) @ back) * (homogeneous(about_px.mean(axis=0)) @ back)[0]
    border = plane.to_mm(seen[side > 0.0]) if (side > 0.0).any() else about
    if not (side > 0.0).all():
        border = np.concatenate([border, about - reach, about + reach])
    low = np.maximum(border.min(axis=0), low - reach)
    high = np.minimum(border.max(axis=0), high + reach)
    scale = px_per_mm or _finest(plane, about)
    width, height = (int(one) + 1 for one in np.ceil((high - low) * scale))
    if max(width, height) > _LARGEST_PX:
        if px_per_mm is not None:
            raise CalibrationError(
                f"{px_per_mm:g} px/mm make a picture of {width}x{height} px; choose a scale below"
                f" {px_per_mm * _LARGEST_PX / max(width, height):.3g}"
            )
        scale *= (_LARGEST_PX - 2) / max(width, height)
        width, height = (int(one) + 1 for one in np.ceil((high - low) * scale))
    # Even, as codecs want.
    return Raster((width + width % 2, height + height % 2), scale, low)


class Rectified:
    """Resamples pictures of one camera; distort takes pixels of a picture without distortion to
    the camera's own, None for a lens without.
    """

    def __init__(
        self, plane: Plane, raster: Raster, distort: Callable[[Array], Array] | None = None
    ) -> None:
        pixels = plane.to_px(raster.places_mm())
        if distort is not None:
            pixels = distort(pixels)
        width, height = raster.size_px
        self._map = np.nan_to_num(pixels, nan=-1e4).astype(np.float32).reshape(height, width, 2)

    def picture(self, picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """The plane, black where the camera does not see it."""
        columns, rows = self._map[..., 0], self._map[..., 1]
        return np.asarray(cv2.remap(picture, columns, rows, cv2.INTER_LINEAR), dtype=np.uint8)


def _border(size_px: tuple[int, int]) -> Array:
    """Pixels around a picture; (n, 2)."""
    share = np.linspace(0.0, 1.0, 33)
    ends = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)])
    sides = [a + share[:, None] * (b - a) for a, b in itertools.pairwise(ends)]
    return np.concatenate(sides) * (size_px[0] - 1, size_px[1] - 1)


def _finest(plane: Plane, about_mm: Array) -> float:
    """px a mm in the reference's middle, the larger of both directions."""
    middle = about_mm.mean(axis=0)
    steps = middle + np.array([(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)])
    px = project(plane.image_from_plane, steps)
    return float(2.0 * np.hypot(*(px[1:] - px[0]).T).max())
