"""Requests that a tracker refuses: a typed reply for who asked, health for who put, the journal.

A flood of them is one line a second in the journal, and one fault.
"""

from __future__ import annotations

import logging
import time

from rhot.errors import RefusalCode, RefusedError
from rhot.process.service import Service

log = logging.getLogger("rhot.pi_tracker")

_LOG_EVERY_S = 1.0


class Refusals:
    """Refusals of one setting; health's values count them as `<setting>_refused`."""

    def __init__(self, service: Service, setting: str) -> None:
        self._service = service
        self._count = f"{setting}_refused"
        self._subject = f"{service.instance} {setting}"
        self._next_line_s = 0.0
        service.values[self._count] = 0

    def refusal(self, text: str, code: RefusalCode) -> RefusedError:
        """The error for who asked; text says what is refused and why."""
        self._service.values[self._count] += 1
        if time.monotonic() >= self._next_line_s:
            self._next_line_s = time.monotonic() + _LOG_EVERY_S
            log.info("%s", text)
        return RefusedError(text, code)

    def tell(self, error: RefusedError) -> None:
        """Say it in health, where who put has no other way to hear of it."""
        self._service.error(str(error), "request_refused", self._subject)

    def clear(self) -> None:
        """A request was granted: what was said of the last is over."""
        self._service.faults.clear("request_refused", self._subject)
