"""The lens's distortion taken out of whole pictures before markers are sought: the seed's first
step, which it gave up for speed.

Off by default, and for comparison: fusion undistorts the few marker positions instead, exactly and
for nothing. Positions found in a rectified picture are put back to the camera's own pixels, so that
messages mean the same with and without it. Pure. What the rectified picture shows from beyond the
camera's is grey. A frame of another size than the lens was calibrated at is a SourceError.
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

# Black of limited-range luma, and no colour.
_BLACK, _NEUTRAL = 16, 128
Maps = tuple[Image, Image]


class Rectifier:
    """For one lens; the rectified picture has its pinhole matrix and size."""

    def __init__(self, lens: Lens) -> None:
        self._camera = Camera(
            "lens", lens.size_px, np.array(lens.matrix), np.array(lens.distortion), np.eye(4)
        )
        width, height = lens.size_px
        self._pixels = self._maps(width, height, 1)
        self._cells = self._maps(width // 2, height // 2, 2)

    def frame(self, frame: Frame) -> Frame:
        """The same frame without distortion."""
        if frame.size_px != self._camera.size_px:
            raise SourceError(
                f"camera {frame.camera!r}: frame {frame.seq} is {frame.size_px[0]}x{frame.size_px[1]}, its lens was calibrated at "
                f"{self._camera.size_px[0]}x{self._camera.size_px[1]}; calibrate it at this size, or set [tracker] rectify = false"
            )
        if frame.layout == "bgr":
            return replace(frame, image=_moved(frame.image, self._pixels, 0))
        width, height = frame.size_px
        chroma = frame.image[height:].reshape(2, height // 2, width // 2)
        planes = [
            _moved(frame.image[:height], self._pixels, _BLACK),
            *(_moved(plane, self._cells, _NEUTRAL) for plane in chroma),
        ]
        return replace(
            frame,
            image=np.concatenate([plane.ravel() for plane in planes]).reshape(
                height * 3 // 2, width
            ),
        )

    def back(self, markers: list[Marker]) -> list[Marker]:
        """Markers of a rectified frame at the pixels where the camera shows them."""
        if not markers:
            return []
        places = (
            self._distorted(np.array([(marker.x_px, marker.y_px) for marker in markers]))
            .round(3)
            .tolist()
        )
        return [
            msgspec.structs.replace(marker, x_px=x, y_px=y)
            for marker, (x, y) in zip(markers, places, strict=True)
        ]

    def _distorted(self, pixels: Array) -> Array:
        """Where the camera shows what the rectified picture has at pixels (n, 2); (n, 2)."""
        m = self._camera.matrix
        y = (pixels[:, 1] - m[1, 2]) / m[1, 1]
        x = (pixels[:, 0] - m[0, 2] - m[0, 1] * y) / m[0, 0]
        return self._camera.pixels_from_rays(np.stack([x, y], axis=1))

    def _maps(self, width: int, height: int, pitch: int) -> Maps:
        """OpenCV's fixed-point maps of a plane whose elements are pitch x pitch pixels."""
        x, y = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        middle = 0.5 * (pitch - 1)
        taken = (
            self._distorted(np.stack([x.ravel(), y.ravel()], axis=1) * pitch + middle) - middle
        ) / pitch
        places = taken.astype(np.float32).reshape(height, width, 2)
        return cv2.convertMaps(places[..., 0].copy(), places[..., 1].copy(), cv2.CV_16SC2)


def _moved(plane: Image, maps: Maps, border: int) -> Image:
    return cv2.remap(
        plane,
        *maps,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(border, border, border),
    )
