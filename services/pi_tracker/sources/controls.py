"""Exposure of a running camera: a mailbox between the event loop and the thread that reads the
camera.

The reader takes what is wanted before its next image and tells what images were really taken with.
A driver that tells nothing leaves `reported` None; whoever waits for it must have a deadline.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

from rhot.files.calibration import Exposure


@dataclass(frozen=True)
class Wanted:
    """Values to be fixed, or None for the camera's automatics."""

    exposure: Exposure | None


class Controls:
    """One camera's exposure. note says what is missing, for a person."""

    def __init__(self, note: str = "") -> None:
        self.note = note
        # What the newest image was taken with, as far as the driver tells.
        self.reported: Exposure | None = None
        # Whether anybody wants to know: asking a driver for every image costs time.
        self.watched = False
        self._lock = threading.Lock()
        self._wanted: Wanted | None = None

    def adjust(self, exposure: Exposure | None) -> None:
        """Ask for these values, or for the automatics, from any thread.

        The last one asked for counts.
        """
        with self._lock:
            self._wanted = Wanted(exposure)
            self.reported = None
            self.watched = exposure is None

    def take(self) -> Wanted | None:
        """What is asked for since the last call; for the reader."""
        with self._lock:
            wanted, self._wanted = self._wanted, None
        return wanted
