"""What a source could not do as it was asked, as faults that begin and end (codes: rhot/faults/).

A mailbox between the thread that reads frames and the event loop that tells health.
"""

from __future__ import annotations

import threading


class Notes:
    """What stands of one camera now."""

    def __init__(self, camera: str) -> None:
        self._camera = camera
        self._lock = threading.Lock()
        self._standing: dict[tuple[str, str], str] = {}

    def report(self, code: str, text: str, about: str = "") -> None:
        """Something is so from now on.

        text is a sentence without the camera's name; about tells several notes of one code apart.
        """
        with self._lock:
            key = (code, f"{self._camera} {about}".rstrip())
            self._standing[key] = f"camera {self._camera!r}: {text}"

    def clear(self, code: str, about: str = "") -> None:
        """It is over; nothing happens if it was not so."""
        with self._lock:
            self._standing.pop((code, f"{self._camera} {about}".rstrip()), None)

    def standing(self) -> dict[tuple[str, str], str]:
        """The texts by (code, subject)."""
        with self._lock:
            return dict(self._standing)

    @property
    def texts(self) -> list[str]:
        """What a person should read, in the order in which it began."""
        return list(self.standing().values())
