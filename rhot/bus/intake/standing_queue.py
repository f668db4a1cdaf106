"""A queue that has stood for a second is not a burst but more than its reader can do.

Whoever is behind for a moment (a slow step, a processor busy elsewhere) catches up, and every
message counts. Where a queue stands, each message waits in it for as long as it is, for ever: an
overloaded fusion answered a second late, and lost as many. So old messages are then skipped until
the queue has been empty: what is answered, is answered in time. After CoDel (Nichols, Jacobson,
"Controlling queue delay", ACM Queue 10(5), 2012). Pure: time is an argument.
"""

from __future__ import annotations

# A message that has waited for less than this is answered whatever there is. Fusion takes no frame
# that is older than some tenths of a second for the present.
_WAIT_S = 0.2
# How long messages wait for longer than that before it is taken for more than a burst.
_PATIENCE_S = 1.0
# A queue whose messages wait for less than this does not stand: a frame at 50 a second.
_CAUGHT_UP_S = 0.02


class StandingQueue:
    """Whether messages of a queue are skipped, by how long each has waited."""

    def __init__(self) -> None:
        # When messages began to wait for too long; None: they do not.
        self._late_since_s: float | None = None
        self._stands = False

    def skips(self, waited_s: float, now_s: float) -> bool:
        """Whether the message that is taken now, after waited_s, is not to be answered."""
        if waited_s < _CAUGHT_UP_S:
            self._stands = False
        if waited_s < _WAIT_S:
            self._late_since_s = None
            return False
        if self._late_since_s is None:
            self._late_since_s = now_s
        self._stands = self._stands or now_s - self._late_since_s >= _PATIENCE_S
        return self._stands
