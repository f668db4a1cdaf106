"""The pictures to be measured: a video by its own times, or a folder; corrected for a known lens.

What can be read of a video that is cut short is measured, and its end is told.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rhot.errors import CaptureError
from rhot.files.calibration import Lens
from rhot.geometry.camera import Camera
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.rectify import Rectifier
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.reader import Reader
from services.pi_tracker.sources.video import VideoReader
from studies.grasp.measure.seeds import Seeds

# Where neither the container nor the person says it.
_FPS = 30.0


@dataclass
class Pictures:
    """A video or a folder of pictures, read from the start as often as asked for.

    fps: a rate to take whatever a video says. about_lens: how a lens was found whose focal length
    is not known. end: how a video broke off, once it was read.
    """

    path: Path
    fps: float | None = None
    lens: Lens | None = None
    about_lens: str = ""
    end: str = field(default="", init=False)

    def frames(self) -> Iterator[Frame]:
        """All frames, of one size, BGR.

        Raises CaptureError (of no frame at all, of frames of several sizes) or SourceError (of
        another size than the lens has).
        """
        rectifier = None if self.lens is None else Rectifier(self.lens)
        reader, first = self._reader(), None
        with closing(reader):
            reader.open()
            while (frame := self._next(reader, first)) is not None:
                first = first or frame
                if frame.size_px != first.size_px:
                    (w, h), (w0, h0) = frame.size_px, first.size_px
                    raise CaptureError(
                        f"{self.path}: picture {frame.seq} is {w}x{h} px, the first is {w0}x{h0}; "
                        "all must be of one size"
                    )
                yield frame if rectifier is None else rectifier.rectify(frame)

    def matrix(self) -> np.ndarray | None:
        """The camera's (3, 3), where the focal length is known."""
        return None if self.lens is None or self.about_lens else np.array(self.lens.matrix)

    def _next(self, reader: Reader, first: Frame | None) -> Frame | None:
        try:
            return reader.read()
        except CaptureError as error:
            if first is None:
                raise
            self.end = str(error)
            return None

    def _reader(self) -> Reader:
        if self.path.is_dir():
            return FolderReader("grasp", self.path, self.fps or _FPS)
        return VideoReader("grasp", self.path, _FPS, rate=self.fps)

    def notes(self) -> list[str]:
        """What is to be said of the pictures, once they were read."""
        notes = [] if not self.end else [f"the video breaks off: {self.end}"]
        if self.about_lens:
            notes.append(self.about_lens)
        if self.path.is_dir() and self.fps is None:
            notes.append(f"pictures have no times: {_FPS:g} a second assumed (--fps)")
        return notes

    def first(self) -> Frame:
        """The first frame."""
        for frame in self.frames():
            return frame
        raise CaptureError(f"{self.path}: holds no picture")


def corrected_seeds(seeds: Seeds, lens: Lens | None) -> Seeds:
    """Seeds in px of the picture as the camera saw it, as px of the corrected one.

    Raises CaptureError where the lens model has nothing there.
    """
    if lens is None or not seeds:
        return dict(seeds)
    camera = Camera(
        "lens", lens.size_px, np.array(lens.matrix), np.array(lens.distortion), np.eye(4)
    )
    rays = camera.rays_from_pixels(list(seeds.values()))  # (n, 2)
    (fx, skew, cx), (_, fy, cy), _ = lens.matrix
    corrected: Seeds = {}
    for place, (x, y) in zip(seeds, rays.tolist(), strict=True):
        if not math.isfinite(x + y):
            raise CaptureError(
                f"seed {place}: the lens calibration has no such place; was it made at this size?"
            )
        corrected[place] = (fx * x + skew * y + cx, fy * y + cy)
    return corrected
