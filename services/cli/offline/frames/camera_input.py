"""One camera's recording, read frame by frame in the order of its stamps.

A recording that breaks off gives its frames up to there and a warning; one without a single frame
is an error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from rhot.errors import CaptureError
from rhot.files.capture import FrameStamp
from services.pi_tracker.image.frame import Frame


class FrameReader(Protocol):
    """A blocking source of frames; read() returns None at the end."""

    def open(self) -> None: ...

    def read(self) -> Frame | None: ...

    def close(self) -> None: ...


@dataclass
class CameraInput:
    """One camera's recording. warnings fill while it is read.

    clock_sigma_ns is the uncertainty of its stamps, -1 where the clock is unknown; total is the
    number of frames to expect, 0 where that is unknown; notes are for people.
    """

    camera: str
    reader: FrameReader
    clock_sigma_ns: int
    total: int = 0
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def frames(self) -> Iterator[Frame]:
        """Every frame that can be read, in order.

        Raises RhotError if there is none.
        """
        count, last_ns = 0, -1
        try:
            self.reader.open()
            while (frame := self.reader.read()) is not None:
                if frame.stamp_ns <= last_ns:
                    raise CaptureError(
                        f"camera {self.camera!r}: frame {frame.seq} is not later than the one "
                        "before; its stamps are damaged"
                    )
                last_ns = frame.stamp_ns
                count += 1
                yield frame
        except CaptureError as error:
            if not count:
                raise
            self.warnings.append(str(error))
        finally:
            self.reader.close()
        if not count:
            raise CaptureError(f"camera {self.camera!r}: no frame could be read")


class StampedReader:
    """A video whose stamps come from a csv beside it.

    The shorter of the two counts; a video that is longer is a CaptureError at the last stamp.
    """

    def __init__(self, video: FrameReader, path: Path, stamps: list[FrameStamp]) -> None:
        """path is the csv's, for the error."""
        self._video, self._path, self._stamps = video, path, stamps

    def open(self) -> None:
        """As FrameReader.open."""
        self._video.open()

    def read(self) -> Frame | None:
        """As FrameReader.read."""
        frame = self._video.read()
        if frame is None:
            return None
        if frame.seq >= len(self._stamps):
            raise CaptureError(
                f"{self._path}: has stamps of {len(self._stamps)} frames, the video has more; "
                "the rest was left out"
            )
        stamp = self._stamps[frame.seq]
        return replace(
            frame, seq=stamp.frame, stamp_ns=stamp.stamp_ns, row_time_ns=stamp.row_time_ns
        )

    def close(self) -> None:
        """As FrameReader.close."""
        self._video.close()
