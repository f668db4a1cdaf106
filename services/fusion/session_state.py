"""The start broadcast's state, which fusion keeps as the rig's master.

It begins as running when fusion is ready; whoever broadcasts later (`rhot session stop`, a client)
changes it. A broadcast that comes twice changes nothing; what was last heard is what late comers
are told.
"""

from __future__ import annotations

from rhot.messages import Session


class SessionState:
    """What the master answers to `control/session`."""

    def __init__(self, now_ns: int) -> None:
        self.session = Session(running=True, start_ns=now_ns)

    def hear(self, session: Session) -> bool:
        """Take in somebody's broadcast (or the echo of the own one).

        Whether it changes anything.
        """
        told = (session.running, session.start_ns)
        if told == (self.session.running, self.session.start_ns):
            return False
        self.session = Session(running=session.running, start_ns=session.start_ns)
        return True
