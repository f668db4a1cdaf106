"""The frame-source interfaces: a blocking reader, and the asynchronous source that services use."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from typing import Protocol

from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.controls import Controls
from services.pi_tracker.sources.notes import Notes


class Reader(Protocol):
    """A source of frames that blocks. read() returns None at the end of a file.

    A camera never ends, it fails with SourceError.
    """

    live: bool
    # What the source could not do as asked.
    notes: Notes

    def open(self) -> None: ...

    def read(self) -> Frame | None: ...

    def close(self) -> None: ...


class Source(Protocol):
    """A source of frames for a service."""

    live: bool
    notes: Notes
    # Exposure, of sources that have it.
    controls: Controls | None
    # Frames that came and were not delivered: overtaken by newer ones, or malformed.
    dropped: int
    rejected: int

    def now_ns(self) -> int:
        """The clock of the stamps."""

    def frames(self) -> AsyncGenerator[Frame, None]:
        """Every frame, or the latest one each time.

        Opens the source, and closes it when the iteration ends.
        """
