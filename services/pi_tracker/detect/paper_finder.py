"""The RHOT paper's marker detection, for comparison (sections 8 and 9.1).

Per colour: HSV, Gaussian, inRange, erosion, dilation, largest contour, its centroid. Searched in
the last box + margin, or in the whole image where the colour was lost. Pure; a colour without a
contour has no marker.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from rhot.files.calibration import Colors
from rhot.files.rig_tables import Tracker
from rhot.messages import Marker
from services.pi_tracker.detect.hsv_range import hsv_mask
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import bgr_image

# Standard deviation of a binary contour's centroid, a 9 px tip at sigma 5: .22 px of disparity
# between two views.
_SIGMA_PX = 0.155
# x, y, width, height; px.
Box = tuple[int, int, int, int]


class PaperFinder:
    """Markers of one camera, frame after frame, as the paper finds them."""

    def __init__(self, colors: Colors, settings: Tracker, color_names: Sequence[str]) -> None:
        self._ranges = {name: colors.colors[name] for name in color_names}
        self._settings = settings
        self._element = np.ones((3, 3), np.uint8)
        self._last_boxes: dict[str, Box] = {}

    def find(self, frame: Frame) -> list[Marker]:
        """Markers of one image, at most one per colour."""
        bgr = bgr_image(frame)
        markers = []
        for name in self._ranges:
            marker = self._marker(bgr, name)
            if marker is not None:
                markers.append(marker)
        return markers

    def mask(self, bgr: Image, name: str) -> Image:
        """The filtered mask of one colour, 0 or 255."""
        hsv = cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)
        if self._settings.gaussian_px > 1:
            size = self._settings.gaussian_px | 1
            hsv = cv2.GaussianBlur(hsv, (size, size), 0)
        mask = hsv_mask(hsv, self._ranges[name])
        mask = cv2.erode(mask, self._element, iterations=self._settings.erode)
        return cv2.dilate(mask, self._element, iterations=self._settings.dilate)

    def _marker(self, bgr: Image, name: str) -> Marker | None:
        """The largest contour of one colour, if its area fits."""
        height, width = bgr.shape[:2]
        x0, y0, x1, y1 = self._search_rect(name, width, height)
        contours, _ = cv2.findContours(
            self.mask(bgr[y0:y1, x0:x1], name), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
        )
        contour = max(contours, key=cv2.contourArea, default=None)
        if contour is None:
            return None
        moments = cv2.moments(contour)
        area = moments["m00"]
        if not max(self._settings.min_area_px, 1.0) <= area <= self._settings.max_area_px:
            return None
        x, y, w, h = cv2.boundingRect(contour)
        self._last_boxes[name] = (x0 + x, y0 + y, w, h)
        return Marker(
            color=name,
            x_px=round(x0 + moments["m10"] / area, 3),
            y_px=round(y0 + moments["m01"] / area, 3),
            area_px=round(area, 1),
            sigma_px=_SIGMA_PX,
            quality=1.0,
        )

    def _search_rect(self, name: str, width: int, height: int) -> Box:
        """The last box and its margin, as x0, y0, x1, y1; forgets the box."""
        box = self._last_boxes.pop(name, None)
        if box is None:
            return 0, 0, width, height
        x, y, w, h = box
        margin = self._settings.roi_margin_px
        return (
            max(x - margin, 0),
            max(y - margin, 0),
            min(x + w + margin, width),
            min(y + h + margin, height),
        )
