"""Any frame as luma and chroma: the one form in which colours are classified and blobs measured.

Chroma is always that of 2x2 pixels, as a camera's YUV420 stream carries it. A BGR image is averaged
2x2 first, never sampled (one pixel's chroma costs .87 px of centroid, the average .41). Luma in
0..255 (full range) is scaled to 16..235, and chroma with it: one table of colours, one scale of
noise and one threshold hold for both. Only the part asked for is converted. An odd last row or
column is left out. Cells are 2x2 pixels: cell (i, j) covers pixels 2i..2i+1, 2j..2j+1, so its
centre lies at pixel 2i + 0.5.

An image that does not have the shape its frame claims raises SourceError.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import cv2
import numpy as np

from rhot.errors import SourceError
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.planes import LIMITED_CHROMA, LIMITED_LUMA, Planes, Rect

# BT.601, Y in 16..235, chroma about 128, from B, G, R in 0..255; the inverse of OpenCV's
# COLOR_YUV2BGR_I420.
_Y_FROM_BGR = (0.097906, 0.504129, 0.256788)
_U_FROM_BGR = (0.439216, -0.290993, -0.148223)
_V_FROM_BGR = (-0.071427, -0.367788, 0.439216)
_LUMA = np.array([[*_Y_FROM_BGR, 16.0]])
_CHROMA = np.array([[*_U_FROM_BGR, 128.0], [*_V_FROM_BGR, 128.0]])


class Picture(Protocol):
    """A frame as luma and chroma."""

    size: tuple[int, int]  # cells (width, height)

    @property
    def planes(self) -> Planes | None:
        """All of it, where nothing has to be converted."""

    def cells(self, rect: Rect, step: int = 1) -> tuple[Image, Image]:
        """Luma (h, w) and chroma u, v (h, w, 2) of every cell of a rectangle.

        With a step, of its first and every step-th row.
        """

    def copy_to(self, rect: Rect, luma: Image, chroma: Image) -> None:
        """Copy a rectangle into buffers of its size.

        luma (2h, 2w) of every pixel, chroma u, v (2, h, w) of every cell.
        """


class _PlanarPicture:
    """I420."""

    def __init__(self, image: Image, width: int, height: int) -> None:
        half_w, half_h = width // 2, height // 2
        self.size = (half_w, half_h)
        self._y = image[:height]
        self._chroma = image[height:].reshape(2, half_h, half_w)
        self._u, self._v = self._chroma
        self.planes = Planes(
            (0, 0, half_w, half_h), self.size, self._y, self._chroma, full_range=False
        )

    def cells(self, rect: Rect, step: int = 1) -> tuple[Image, Image]:
        x0, y0, x1, y1 = rect
        luma = _cell_means(_pixels(self._y, rect))
        # Merging copies of the parts is three times faster than merging the parts.
        u = np.ascontiguousarray(self._u[y0:y1:step, x0:x1])
        v = np.ascontiguousarray(self._v[y0:y1:step, x0:x1])
        return luma[::step], cv2.merge((u, v))

    def copy_to(self, rect: Rect, luma: Image, chroma: Image) -> None:
        x0, y0, x1, y1 = rect
        luma[:] = self._y[2 * y0 : 2 * y1, 2 * x0 : 2 * x1]
        chroma[:] = self._chroma[:, y0:y1, x0:x1]


class _FullRangePicture:
    """I420 with luma in 0..255, scaled to limited range where it is asked for."""

    def __init__(self, limited: _PlanarPicture) -> None:
        self.size = limited.size
        self._as_limited = limited
        self.planes = replace(limited.planes, full_range=True)

    def cells(self, rect: Rect, step: int = 1) -> tuple[Image, Image]:
        luma, chroma = self._as_limited.cells(rect, step)
        return cv2.LUT(luma, LIMITED_LUMA), cv2.LUT(chroma, LIMITED_CHROMA)

    def copy_to(self, rect: Rect, luma: Image, chroma: Image) -> None:
        self._as_limited.copy_to(rect, luma, chroma)
        luma[:] = LIMITED_LUMA[luma]
        chroma[:] = LIMITED_CHROMA[chroma]


class _BgrPicture:
    """BGR, converted where it is asked for."""

    def __init__(self, image: Image, width: int, height: int) -> None:
        self.size = (width // 2, height // 2)
        self.planes = None
        self._image = image

    def cells(self, rect: Rect, step: int = 1) -> tuple[Image, Image]:
        bgr = _cell_means(_pixels(self._image, rect))[::step]
        return cv2.transform(bgr, _LUMA), cv2.transform(bgr, _CHROMA)

    def copy_to(self, rect: Rect, luma: Image, chroma: Image) -> None:
        bgr = _pixels(self._image, rect)
        luma[:] = cv2.transform(bgr, _LUMA)
        chroma[:] = cv2.split(cv2.transform(_cell_means(bgr), _CHROMA))


def picture(frame: Frame) -> Picture:
    """The frame as luma and chroma; no pixel is read yet."""
    width, height = frame.size_px
    image = frame.image
    expected = (height * 3 // 2, width) if frame.layout == "i420" else (height, width, 3)
    if image.shape != expected or image.dtype != np.uint8 or min(width, height) < 2:
        raise SourceError(
            f"camera {frame.camera!r}: frame {frame.seq} is an image of shape {image.shape} "
            f"({image.dtype}), expected {expected} of uint8 for {width}x{height} {frame.layout}"
        )
    if frame.layout == "bgr":
        return _BgrPicture(image, width, height)
    if width % 2 or height % 2:
        raise SourceError(f"camera {frame.camera!r}: I420 needs even sizes, got {width}x{height}")
    planes = _PlanarPicture(np.ascontiguousarray(image), width, height)
    return _FullRangePicture(planes) if frame.full_range else planes


def planes_of(image: Picture, rect: Rect) -> Planes:
    """A copy of a rectangle of a picture as planes."""
    h, w = rect[3] - rect[1], rect[2] - rect[0]
    luma, chroma = np.empty((2 * h, 2 * w), np.uint8), np.empty((2, h, w), np.uint8)
    image.copy_to(rect, luma, chroma)
    return Planes(rect, image.size, luma, chroma, full_range=False)


def bgr_image(frame: Frame) -> Image:
    """The frame as BGR (h, w, 3), for people and for what works in RGB."""
    if frame.layout == "bgr":
        return frame.image
    if not frame.full_range:
        return cv2.cvtColor(frame.image, cv2.COLOR_YUV2BGR_I420)
    # OpenCV has no I420 of full range, but YCrCb is.
    width, height = frame.size_px
    chroma = frame.image[height:].reshape(2, height // 2, width // 2)
    u, v = (cv2.resize(plane, (width, height), interpolation=cv2.INTER_NEAREST) for plane in chroma)
    return cv2.cvtColor(cv2.merge((frame.image[:height], v, u)), cv2.COLOR_YCrCb2BGR)


def _pixels(plane: Image, rect: Rect) -> Image:
    """The pixels of a rectangle of cells, (2h, 2w) or (2h, 2w, 3)."""
    x0, y0, x1, y1 = rect
    return plane[2 * y0 : 2 * y1, 2 * x0 : 2 * x1]


def _cell_means(pixels: Image) -> Image:
    """The mean of every 2x2 pixels; (2h, 2w, ...) -> (h, w, ...)."""
    height, width = pixels.shape[:2]
    return cv2.resize(pixels, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
