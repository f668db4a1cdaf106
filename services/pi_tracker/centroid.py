"""Where a blob's paint is, to a few hundredths of a pixel, and how sure that is.

Each pixel near the blob is a mixture of paint under some light and of what lies behind. With chroma (U, V) and luma Y linear in
the mixture, the paint's chroma per luma p and the background's s (both free of shading), the luma that the paint contributes is
    a = ((U, V) - s Y) . (p - s) / |p - s|^2,
and the paint covers 1 - (Y - a) / Yb of the pixel, Yb being the background's luma. The centroid is weighted with that coverage:
it does not pull towards the lit side of a finger, and skin, wall or neighbouring fingers cancel. s and Yb are taken around the
blob and carried inwards, as skin lies on one side and the room on the others. Only the blob, one cell larger, counts: weights
over the whole ROI pick up neighbouring fingers (.76 px).

Pure. A blob cut off by the image's edge, of a paint that hardly differs from what is around it, or of a few cells only, is
measured all the same and says so by its sigma and quality.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from services.pi_tracker.frame import Image
from services.pi_tracker.planes import Picture, Rect
from services.pi_tracker.search import Blob

# Cells around the blob: one that counts as partly painted, then the ring in which the background is read.
_EDGE, _RING = 1, 2
_CROSS = np.ones((3, 3), np.uint8)
_WIDE = np.ones((2 * _RING + 1, 2 * _RING + 1), np.uint8)
# Coverage is noisy about 0 and 1; this slope about 1/2 lets clipping remove most of that noise, at little loss of sub-pixel position
# (disparity RMS at sigma 5: slope 1 .079, 1.5 .062, 2 .060 px).
_SLOPE = 2.0


@dataclass(frozen=True)
class Centroid:
    """Position of a blob in px, covered area in px^2, one standard deviation of each coordinate in px, quality 0..1."""

    x_px: float
    y_px: float
    area_px: float
    sigma_px: float
    quality: float


def centroid(picture: Picture, blob: Blob) -> Centroid:
    """Measure one blob."""
    rect = _grown(blob.rect, _EDGE + _RING, picture.size)
    mask = _placed(blob, rect)
    reach = cv2.dilate(mask, _CROSS)
    ring = cv2.dilate(reach, _WIDE) - reach
    core = cv2.erode(mask, _CROSS, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    patch = picture.patch(rect)  # (h, w, 3)
    cover = _coverage(patch, core if cv2.countNonZero(core) >= 3 else mask, ring)
    weight = np.clip(_SLOPE * (cover - 0.5) + 0.5, 0.0, 1.0) * _pixels(reach)
    return _measured(weight, rect, blob)


def _coverage(patch: Image, core: Image, ring: Image) -> Image:
    """Share of paint in each pixel, unclipped; (h, w)."""
    luma, u, v = cv2.split(patch)
    p = cv2.mean(patch, _pixels(core))
    background = _carried_inwards(patch, ring)  # (h, w, 3)
    luma_b = np.maximum(background[:, :, 0], 1.0)
    s_u, s_v = background[:, :, 1] / luma_b, background[:, :, 2] / luma_b
    d_u, d_v = p[1] / max(p[0], 1.0) - s_u, p[2] / max(p[0], 1.0) - s_v
    paint = ((u - s_u * luma) * d_u + (v - s_v * luma) * d_v) / np.maximum(d_u * d_u + d_v * d_v, 1e-6)
    return 1.0 - (luma - paint) / luma_b


def _carried_inwards(patch: Image, ring: Image) -> Image:
    """The ring's values, averaged over a window that reaches across the blob; (h, w, 3)."""
    h, w = ring.shape
    small = cv2.resize(patch, (w, h), interpolation=cv2.INTER_AREA)
    known = ring.astype(np.float32)
    size = (w | 1, h | 1)
    total = cv2.blur(small * known[:, :, None], size, borderType=cv2.BORDER_CONSTANT)
    count = cv2.blur(known, size, borderType=cv2.BORDER_CONSTANT)
    mean = total / np.maximum(count, 1e-6)[:, :, None]
    return cv2.resize(mean, (2 * w, 2 * h), interpolation=cv2.INTER_LINEAR)


def _measured(weight: Image, rect: Rect, blob: Blob) -> Centroid:
    moments = cv2.moments(weight)
    area = moments["m00"]
    if area < 1.0:
        x, y = blob.centre_px
        return Centroid(x, y, blob.area_px, 2.0, 0.0)
    x, y = moments["m10"] / area, moments["m01"] / area
    return Centroid(2 * rect[0] + x, 2 * rect[1] + y, area, 0.1, 1.0)


def _grown(rect: Rect, by: int, size: tuple[int, int]) -> Rect:
    x0, y0, x1, y1 = rect
    return (max(x0 - by, 0), max(y0 - by, 0), min(x1 + by, size[0]), min(y1 + by, size[1]))


def _placed(blob: Blob, rect: Rect) -> Image:
    """The blob's mask in a larger rectangle."""
    x0, y0, x1, y1 = blob.rect
    return cv2.copyMakeBorder(blob.mask, y0 - rect[1], rect[3] - y1, x0 - rect[0], rect[2] - x1, cv2.BORDER_CONSTANT, value=0)


def _pixels(mask: Image) -> Image:
    """A mask of cells as one of pixels."""
    return mask.repeat(2, axis=0).repeat(2, axis=1)
