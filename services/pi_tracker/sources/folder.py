"""A folder of images as a frame source, in the order of the numbers in their names, at the frame
rate of the [[camera]] table.

An image that cannot be decoded, or a folder without any, is a CaptureError.
"""

from __future__ import annotations

import re
from pathlib import Path

import cv2

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Frame

_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".webp")


class FolderReader:
    """Images of one folder; start_ns is the stamp of the first."""

    live = False

    def __init__(self, camera: str, folder: Path, fps: float, start_ns: int = 0) -> None:
        self.notes: list[str] = []
        self._camera = camera
        self._folder = folder
        self._fps = fps
        self._start_ns = start_ns
        self._paths: list[Path] = []
        self._seq = 0

    def open(self) -> None:
        if not self._folder.is_dir():
            raise CaptureError(f"{self._folder}: no such folder of images")
        self._paths = sorted(
            (path for path in self._folder.iterdir() if path.suffix.lower() in _SUFFIXES),
            key=_by_number,
        )
        if not self._paths:
            raise CaptureError(
                f"{self._folder}: has no images; it should hold files {', '.join('*' + s for s in _SUFFIXES)}"
            )

    def read(self) -> Frame | None:
        if self._seq >= len(self._paths):
            return None
        path = self._paths[self._seq]
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise CaptureError(
                f"{path}: cannot be decoded (image {self._seq + 1} of {len(self._paths)}); remove or replace it"
            )
        stamp_ns = self._start_ns + round(self._seq * 1e9 / self._fps)
        frame = Frame(
            self._camera, self._seq, stamp_ns, 0.0, (image.shape[1], image.shape[0]), image, "bgr"
        )
        self._seq += 1
        return frame

    def close(self) -> None:
        self._paths = []


def _by_number(path: Path) -> list[tuple[int, int, str]]:
    """img2 before img10."""
    return [
        (0, int(part), "") if part.isdigit() else (1, 0, part)
        for part in re.split(r"(\d+)", path.name)
    ]
