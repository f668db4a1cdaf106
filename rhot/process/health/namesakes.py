"""Who else runs under this service's name: each beat of health says which session it is of.

Two services of one name publish on the same keys, and who listens gets both results in turn. Both
say so, the one that came later and the one that was first. Pure: time is an argument.
"""

from __future__ import annotations

from dataclasses import dataclass

from rhot.messages.health import Health

# A beat comes each second: three of them missing, and the other is gone.
GONE_S = 3.5
# The last beat of the process that this one replaces may still be on its way; two are another's.
_BEATS = 2
# More than these are named by no one; sessions come from the network, memory must not.
_MAX_OTHERS = 8


@dataclass
class _Other:
    health: Health
    beats: int
    heard_s: float


class Namesakes:
    """The other services of the same name, by their beats."""

    def __init__(self, session: str) -> None:
        """session is the own one: its beats come back, too."""
        self._session = session
        self._others: dict[str, _Other] = {}

    def note(self, health: Health, now_s: float) -> None:
        """Take in a beat of that name; now_s is a monotonic clock."""
        if health.session == self._session:
            return
        known = self._others.get(health.session)
        if known is None and len(self._others) >= _MAX_OTHERS:
            return
        beats = known.beats + 1 if known else 1
        self._others[health.session] = _Other(health, beats, now_s)

    def texts(self, rig: str, own_uptime_s: float, now_s: float) -> dict[str, str]:
        """What is wrong now, by who it is (session); who has fallen silent is forgotten."""
        self._others = {
            session: other
            for session, other in self._others.items()
            if now_s - other.heard_s < GONE_S
        }
        return {
            session[:8] or "unknown": _text(rig, other.health, own_uptime_s)
            for session, other in self._others.items()
            if other.beats >= _BEATS
        }


def _text(rig: str, other: Health, own_uptime_s: float) -> str:
    order = "was there first" if other.uptime_s > own_uptime_s else "came later"
    name = other.service if other.instance == "main" else f"{other.service}/{other.instance}"
    where = f"on {other.host}" if other.host else "on an unknown host"
    return f"another {name} runs for rig {rig!r}, {where} (pid {other.pid}); it {order}"
