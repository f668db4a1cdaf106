"""Which rig of a process that serves several the running code belongs to.

Log lines and systemd's status are the process's; with this they name the rig. Empty in a process
that serves one rig, and outside of all rigs.
"""

from __future__ import annotations

from contextvars import ContextVar

# Tasks inherit it from the task that made them.
RIG: ContextVar[str] = ContextVar("rig", default="")
# How many of the process's rigs stand before it, in the order of their files.
PLACE: ContextVar[int] = ContextVar("place", default=0)


# The newest status of each rig.
_statuses: dict[str, str] = {}


def enter(rig: str) -> None:
    """From here on the current task serves this rig, and no longer the one before."""
    _statuses.pop(RIG.get(), None)
    RIG.set(rig)


def joined_status(text: str) -> str:
    """The status of all rigs, with this text as the current one's: `name: text` of each, and the
    text as it is where the process serves one.
    """
    _statuses[RIG.get()] = text
    return "; ".join(f"{rig}: {said}" if rig else said for rig, said in _statuses.items())
