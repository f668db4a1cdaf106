"""Undistortion of whole pictures before markers are searched; off by default, for comparison.

The RHOT paper began with it and gave it up for speed. rhot's fusion undistorts the few marker
positions instead (rhot/geometry/camera.py): exact, and next to no cost.

Why OpenCV's maps: a whole picture needs the inverse of undistortion, i.e. for each rectified pixel
the place in the camera's image to sample. Camera.pixels_from_rays gives it in closed form, once per
lens; cv2.remap then resamples every frame with these maps. That takes 2.9 ms for 640 x 480 in
YUV420, undistorting as many points by Camera.rays_from_pixels 187 ms. So there is no second lens
model here, and tests/services/pi_tracker/image/test_rectify.py proves that rectified pictures agree
with Camera.rays_from_pixels.

Markers found in a rectified picture are mapped back to the camera's own pixels: messages mean the
same with and without it. Pure. Pixels of the rectified picture that the camera does not see are
black. A frame of another size than the lens was calibrated at is a SourceError.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import msgspec
import numpy as np

from rhot.errors import SourceError
from rhot.files.calibration import Lens
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.messages import Marker
from services.pi_tracker.image.frame import Frame, Image

# Black of limited-range luma, of full-range luma, and no colour.
_BLACK, _FULL_BLACK, _NEUTRAL = 16, 0, 128
Maps = tuple[Image, Image]


class Rectifier:
    """Undistorts the pictures of one lens; they keep its pinhole matrix and size."""

    def __init__(self, lens: Lens) -> None:
        self._camera = Camera(
            "lens", lens.size_px, np.array(lens.matrix), np.array(lens.distortion), np.eye(4)
        )
        width, height = lens.size_px
        self._pixel_maps = self._maps(width, height, 1)
        self._cell_maps = self._maps(width // 2, height // 2, 2)

    def rectify(self, frame: Frame) -> Frame:
        """The same frame without distortion."""
        if frame.size_px != self._camera.size_px:
            seen, calibrated = (f"{w}x{h}" for w, h in (frame.size_px, self._camera.size_px))
            raise SourceError(
                f"camera {frame.camera!r}: frame {frame.seq} is {seen}, its lens was calibrated at "
                f"{calibrated}; calibrate it at this size, or set [tracker] rectify = false"
            )
        if frame.layout == "bgr":
            return replace(frame, image=_resampled(frame.image, self._pixel_maps, 0))
        width, height = frame.size_px
        chroma = frame.image[height:].reshape(2, height // 2, width // 2)
        black = _FULL_BLACK if frame.full_range else _BLACK
        planes = [
            _resampled(frame.image[:height], self._pixel_maps, black),
            *(_resampled(plane, self._cell_maps, _NEUTRAL) for plane in chroma),
        ]
        packed = np.concatenate([plane.ravel() for plane in planes])
        return replace(frame, image=packed.reshape(height * 3 // 2, width))

    def to_camera_pixels(self, markers: list[Marker]) -> list[Marker]:
        """Markers of a rectified frame at the pixels where the camera shows them."""
        if not markers:
            return []
        rectified_px = np.array([(marker.x_px, marker.y_px) for marker in markers])  # (n, 2)
        camera_px = self._distorted(rectified_px).round(3).tolist()
        return [
            msgspec.structs.replace(marker, x_px=x, y_px=y)
            for marker, (x, y) in zip(markers, camera_px, strict=True)
        ]

    def _distorted(self, rectified_px: Array) -> Array:
        """Camera pixels (n, 2) of pixels (n, 2) of the rectified picture."""
        m = self._camera.matrix
        y = (rectified_px[:, 1] - m[1, 2]) / m[1, 1]
        x = (rectified_px[:, 0] - m[0, 2] - m[0, 1] * y) / m[0, 0]
        return self._camera.pixels_from_rays(np.stack([x, y], axis=1))

    def _maps(self, width: int, height: int, pitch: int) -> Maps:
        """OpenCV's fixed-point maps of a plane whose elements are pitch x pitch pixels."""
        x, y = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        elements = np.stack([x.ravel(), y.ravel()], axis=1)  # (n, 2)
        # An element's centre, in pixels from its first pixel's centre.
        centre = 0.5 * (pitch - 1)
        sources = (self._distorted(elements * pitch + centre) - centre) / pitch
        maps = sources.astype(np.float32).reshape(height, width, 2)
        return cv2.convertMaps(maps[..., 0].copy(), maps[..., 1].copy(), cv2.CV_16SC2)


def _resampled(plane: Image, maps: Maps, border: int) -> Image:
    return cv2.remap(
        plane,
        *maps,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(border, border, border),
    )
