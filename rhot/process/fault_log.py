"""What is wrong with a service now: conditions that begin, last and end, each told once.

A condition stands from `report` until `clear`, and is one line in the journal when it begins and
one when it ends. What merely happened, `event`, stands for a while after the last time. Time is an
argument, so that tests need not wait.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rhot.faults import fault_kind
from rhot.messages.health import MAX_FAULTS, MAX_TEXT, Fault

log = logging.getLogger("rhot.faults")

# Long enough that a person who looks up at the page still reads it, short enough that it is over
# before somebody acts on it.
EVENT_S = 30.0
_LEVEL = {"error": logging.ERROR, "warning": logging.WARNING}
_MAX_SUBJECT = 100


@dataclass
class _Standing:
    fault: Fault
    until_ns: int | None


class FaultLog:
    """The faults of one service. now_ns is CLOCK_REALTIME."""

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._standing: dict[tuple[str, str], _Standing] = {}

    def report(self, code: str, text: str, subject: str = "", action: str = "") -> None:
        """A condition that stands until it is cleared; a new text replaces the old one silently.

        code is one of rhot.faults; text says what is wrong in one sentence; action replaces the
        list's own where more is known.
        """
        self._add(code, text, subject, action, None)

    def event(
        self, code: str, text: str, subject: str = "", action: str = "", for_s: float = EVENT_S
    ) -> None:
        """Something that happened: it stands for_s seconds after the last time."""
        until_ns = self._now_ns() + round(for_s * 1e9)
        self._add(code, text, subject, action, until_ns)

    def clear(self, code: str, subject: str = "") -> None:
        """The condition is over; nothing happens if it did not stand."""
        self._end(code, subject[:_MAX_SUBJECT])

    def replace(self, code: str, texts: Mapping[str, str], actions: Mapping[str, str] = {}) -> None:
        """Exactly these subjects have this fault now, with these texts: the others' are over."""
        for _, subject in [key for key in self._standing if key[0] == code]:
            if subject not in texts:
                self._end(code, subject)
        for subject, text in texts.items():
            self.report(code, text, subject, actions.get(subject, ""))

    def standing(self) -> list[Fault]:
        """What is wrong now: errors first, then by age. Events that are old end here."""
        now_ns = self._now_ns()
        for (code, subject), one in list(self._standing.items()):
            # An event is over without a line: it was one when it happened.
            if one.until_ns is not None and one.until_ns <= now_ns:
                del self._standing[code, subject]
        faults = [one.fault for one in self._standing.values()]
        return sorted(faults, key=lambda fault: (fault.severity, fault.since_ns))[:MAX_FAULTS]

    def _add(self, code: str, text: str, subject: str, action: str, until_ns: int | None) -> None:
        kind = fault_kind(code)
        subject = subject[:_MAX_SUBJECT]
        key = (code, subject)
        known = self._standing.get(key)
        # Subjects may come from the network: strangers' names must not fill the memory.
        if known is None and len(self._standing) >= MAX_FAULTS:
            return
        fault = Fault(
            code=code,
            severity=kind.severity,
            subject=subject,
            text=text[:MAX_TEXT],
            action=(action or kind.action_for(subject))[:MAX_TEXT],
            since_ns=known.fault.since_ns if known else max(0, self._now_ns()),
        )
        self._standing[key] = _Standing(fault, until_ns)
        if known is None:
            log.log(_LEVEL[kind.severity], "%s", one_line(fault))

    def _end(self, code: str, subject: str) -> None:
        one = self._standing.pop((code, subject), None)
        if one is not None and one.until_ns is None:
            lasted_s = (self._now_ns() - one.fault.since_ns) * 1e-9
            log.info("over after %.0f s: %s [%s]", max(0.0, lasted_s), one.fault.text, code)


def one_line(fault: Fault) -> str:
    """A fault as one line of text: what is wrong, what to do, and its code."""
    return f"{fault.text}; {fault.action} [{fault.code}]"
