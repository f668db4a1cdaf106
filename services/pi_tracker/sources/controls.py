"""Exposure of a running camera: a mailbox between the event loop and the thread that reads frames.

The reader takes the last request before its next image, and reports what images were really taken
with. A driver that reports nothing leaves `reported` None; whoever waits for it must have a
deadline.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

from rhot.files.calibration import Exposure

# What a source notes as camera_automatic until it is calibrated.
UNCALIBRATED = "no exposure calibration: its automatics stay on, and colours may drift"


@dataclass(frozen=True)
class ExposureRequest:
    """Values to be fixed, or None for the camera's automatics."""

    exposure: Exposure | None


class Controls:
    """One camera's exposure. note says what is missing, for a person."""

    def __init__(self, note: str = "") -> None:
        self.note = note
        # What the newest image was taken with, as far as the driver tells.
        self.reported: Exposure | None = None
        # Whether anybody waits for a report: asking a driver for every image costs time.
        self.watched = False
        self._lock = threading.Lock()
        self._request: ExposureRequest | None = None

    def adjust(self, exposure: Exposure | None) -> None:
        """Request these values, or the automatics, from any thread.

        The last request counts.
        """
        with self._lock:
            self._request = ExposureRequest(exposure)
            self.reported = None
            self.watched = exposure is None

    def take(self) -> ExposureRequest | None:
        """The request since the last call; for the reader."""
        with self._lock:
            request, self._request = self._request, None
        return request
