"""One exchange with a master's clock, and which master to follow where several answer. Pure.

A rig has one master. A second one (a forgotten fusion on another computer) would move every stamp
by the difference of the two clocks; so who follows one stays with it until it is gone, and says
that there are several.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from rhot.bus.queries import Replies
from rhot.errors import UNDECODABLE
from rhot.messages import ClockEcho

# Exchanges in a row, one a second, without the master that is followed until another one is taken:
# a restart of fusion is over by then, and a clock that is not asked for 3 s is off by .3 ms at most
# (100 ppm).
_PATIENCE = 3


@dataclass(frozen=True)
class ClockExchange:
    """When was asked and when answered, on the own clock, and what a master said."""

    asked_ns: int
    answered_ns: int
    echo: ClockEcho

    @property
    def stamps(self) -> tuple[int, int, int]:
        """(asked, the master's answer, answered), as rhot.clock.OffsetEstimator.update takes it."""
        return self.asked_ns, self.echo.master_ns, self.answered_ns

    @property
    def offset_ns(self) -> int:
        """Own clock minus the master's, to half the time it took."""
        return (self.asked_ns + self.answered_ns) // 2 - self.echo.master_ns


def exchanges(asked_ns: int, replies: Replies) -> list[ClockExchange]:
    """What was answered to one question; what does not decode is left out."""
    found = []
    for reply in replies.good:
        with contextlib.suppress(*UNDECODABLE):
            echo = msgspec.json.decode(reply.payload, type=ClockEcho)
            found.append(ClockExchange(asked_ns, reply.received_ns, echo))
    return found


class MasterChoice:
    """The master whose clock is followed: the first that was heard, until it is gone."""

    def __init__(self) -> None:
        self._session: str | None = None
        self._missed = 0

    def choose(self, exchanges: Sequence[ClockExchange]) -> ClockExchange | None:
        """Of what one round of asking brought the exchange that counts, or None.

        Where several answer at first, the one that has been there longest is taken: all who ask
        then agree.
        """
        followed = [one for one in exchanges if one.echo.session == self._session]
        if not followed and self._session is not None:
            self._missed += 1
            if self._missed < _PATIENCE:
                return None
        if not exchanges:
            return None
        chosen = followed[0] if followed else max(exchanges, key=lambda one: one.echo.uptime_ns)
        self._session, self._missed = chosen.echo.session, 0
        return chosen


def several_masters(exchanges: Sequence[ClockExchange]) -> str | None:
    """What is wrong in a sentence if more than one master answers, None if all is well."""
    by_session = {one.echo.session: one for one in exchanges}
    if len(by_session) < 2:
        return None
    masters = sorted(by_session.values(), key=lambda one: -one.echo.uptime_ns)
    offsets = [one.offset_ns for one in masters]
    hosts = ", ".join(one.echo.host or "a nameless host" for one in masters[:4])
    return (
        f"{len(masters)} services answer for the master's clock, on {hosts}: their clocks differ"
        f" by {(max(offsets) - min(offsets)) * 1e-6:.1f} ms"
    )
