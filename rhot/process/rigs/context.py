"""Which rig and which service of a process that has several the running code belongs to.

Log lines and systemd's status are the process's; with this they name the rig, and the service that
another one's process serves as well. Empty in a process that serves one rig, outside of all rigs,
and in the service that the process is called after.
"""

from __future__ import annotations

from contextvars import ContextVar

# Tasks inherit it from the task that made them.
RIG: ContextVar[str] = ContextVar("rig", default="")
SERVICE: ContextVar[str] = ContextVar("service", default="")
# How many of the process's rigs stand before it, in the order of their files.
PLACE: ContextVar[int] = ContextVar("place", default=0)


# The newest status of each rig's services.
_statuses: dict[tuple[str, str], str] = {}


def enter(rig: str) -> None:
    """From here on the current task serves this rig, and no longer the one before."""
    for place in [place for place in _statuses if place[0] == RIG.get()]:
        del _statuses[place]
    RIG.set(rig)


def who(name: str = "") -> str:
    """Whose code runs, as in a text of a process called name: `name rig`, the name being that of
    the service if it is another. Parts that are empty are left out.
    """
    return f"{SERVICE.get() or name} {RIG.get()}".strip()


def joined_status(text: str) -> str:
    """The status of all rigs and services, with this text as the current one's: `who: text` of
    each, and the text as it is of the process's own service where it serves one rig.
    """
    _statuses[RIG.get(), SERVICE.get()] = text
    told = [(f"{service} {rig}".strip(), said) for (rig, service), said in _statuses.items()]
    return "; ".join(f"{name}: {said}" if name else said for name, said in told)
