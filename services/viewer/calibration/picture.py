"""The picture of the calibration page: masks of what each range takes, and boxes around the patches
of paint that were found. Pure.

A picture that cannot be decoded is None, and the page keeps the last one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rhot.messages.camera import ColorRange, Patch
from services.viewer.live.palette import Rgb

Image = npt.NDArray[Any]
# Masks are nearly opaque, so that holes show, and outlined: white around what the chosen colour
# takes, black around the others.
_STRENGTH = 0.8
_CHOSEN, _OTHER = (255, 255, 255), (0, 0, 0)
# As the tracker's erosion does: single pixels are noise and are not taken.
_KERNEL = np.ones((2, 2), np.uint8)


def decoded(picture: bytes) -> Image | None:
    """PNG as BGR (h, w, 3), None if it is no picture."""
    try:
        return cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        # No bytes, or a picture larger than memory.
        return None


def mask_of(hsv: Image, span: ColorRange) -> Image:
    """255 where an HSV image (h, w, 3) lies in a range, as the tracker sees it."""
    low, high = np.array(span.hsv_low, np.uint8), np.array(span.hsv_high, np.uint8)
    if span.hsv_low[0] <= span.hsv_high[0]:
        mask = cv2.inRange(hsv, low, high)
    else:
        above = cv2.inRange(hsv, low, np.array([179, *span.hsv_high[1:]], np.uint8))
        mask = cv2.bitwise_or(
            above, cv2.inRange(hsv, np.array([0, *span.hsv_low[1:]], np.uint8), high)
        )
    # An even kernel reaches to one side; opposite anchors bring the mask back to its place.
    return cv2.dilate(cv2.erode(mask, _KERNEL, anchor=(0, 0)), _KERNEL, anchor=(1, 1))


def annotated(
    bgr: Image,
    ranges: Mapping[str, ColorRange],
    paints: Mapping[str, Rgb],
    chosen: str,
    patches: Sequence[Patch],
    *,
    masks: bool,
) -> Image:
    """The picture as RGB (h, w, 3) with boxes, and with masks in the colours of the paints."""
    rgb = cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)
    if masks:
        # Averaged over 2x2, as the tracker's cells are.
        small = cv2.resize(bgr, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        hsv = cv2.cvtColor(small, cv2.COLOR_BGR2HSV)
        for color, span in ranges.items():
            outline = _CHOSEN if color == chosen else _OTHER
            _draw_mask(rgb, mask_of(hsv, span), paints.get(color, _CHOSEN), outline)
    for patch in patches:
        x, y, w, h = patch.box_px
        cv2.rectangle(rgb, (x - 4, y - 4), (x + w + 3, y + h + 3), _CHOSEN, 1)
    return rgb


def _draw_mask(rgb: Image, small_mask: Image, paint: Rgb, outline: Rgb) -> None:
    """Paint a mask of half the picture's size over it, in place."""
    size = (rgb.shape[1], rgb.shape[0])
    mask = cv2.resize(small_mask, size, interpolation=cv2.INTER_NEAREST)
    taken = mask > 0
    mixed = _STRENGTH * np.array(paint) + (1.0 - _STRENGTH) * rgb[taken]
    rgb[taken] = mixed.astype(np.uint8)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(rgb, contours, -1, outline, 1)
