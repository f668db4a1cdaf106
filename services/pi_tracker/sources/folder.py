"""A folder of images as a frame source, in the order of the numbers in their names.

The frame rate is that of the [[camera]] table. An image that cannot be decoded, or a folder without
any, is a CaptureError.
"""

from __future__ import annotations

import re
from pathlib import Path

import cv2

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.notes import Notes
from services.pi_tracker.sources.numbered_frames import NumberedFrames

_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".webp")


class FolderReader:
    """Images of one folder; start_ns is the stamp of the first."""

    live = False

    def __init__(self, camera: str, folder: Path, fps: float, start_ns: int = 0) -> None:
        self.notes = Notes(camera)
        self._folder = folder
        self._paths: list[Path] = []
        self._frames = NumberedFrames(camera, fps, start_ns)

    def open(self) -> None:
        if not self._folder.is_dir():
            raise CaptureError(f"{self._folder}: no such folder of images")
        self._paths = sorted(
            (path for path in self._folder.iterdir() if path.suffix.lower() in _SUFFIXES),
            key=_number_key,
        )
        if not self._paths:
            valid = ", ".join("*" + suffix for suffix in _SUFFIXES)
            raise CaptureError(f"{self._folder}: has no images; it should hold files {valid}")

    def name_of(self, number: int) -> str:
        """The file of a frame's number, once the folder is open."""
        return self._paths[number].name

    def read(self) -> Frame | None:
        number = self._frames.count
        if number >= len(self._paths):
            return None
        path = self._paths[number]
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise CaptureError(
                f"{path}: cannot be decoded (image {number + 1} of {len(self._paths)}); "
                "remove or replace it"
            )
        return self._frames.next(image)

    def close(self) -> None:
        self._paths = []


def _number_key(path: Path) -> list[tuple[int, int, str]]:
    """Sorts img2 before img10."""
    return [
        (0, int(part), "") if part.isdigit() else (1, 0, part)
        for part in re.split(r"(\d+)", path.name)
    ]
