"""The session's state, which fusion keeps as the rig's master.

It begins as running when fusion is ready; whoever broadcasts later (`rhot session stop`, a client)
changes it. A broadcast that comes twice changes nothing. Who asks later is told the latest one.
"""

from __future__ import annotations

from rhot.messages import Session


class SessionState:
    """What the master answers to `control/session`."""

    def __init__(self, now_ns: int) -> None:
        self.session = Session(running=True, start_ns=now_ns)

    def update(self, session: Session) -> bool:
        """Take in a broadcast, or the echo of the own one; whether it changes anything."""
        received = (session.running, session.start_ns)
        if received == (self.session.running, self.session.start_ns):
            return False
        self.session = Session(running=session.running, start_ns=session.start_ns)
        return True
