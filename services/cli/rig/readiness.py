"""Whether a rig that was started is up: every service alive, nothing wrong that stops poses. Pure.

Fed with who comes and goes (liveliness tokens) and with their health. What is missing is told with
its reason: what a dead process said last, or the fault that stands in its health.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rhot.bus.liveliness import Alive
from rhot.files.config import RigConfig
from rhot.messages.health import Health

Who = tuple[str, str]

# Faults that are no error of their service, but leave a rig without poses.
_STOPS_POSES = ("session_stopped",)
# A camera's tracker warms up within seconds; a first start of fusion compiles for a minute.
_STARTING = {
    "fusion": "starting; the first start compiles for a minute",
    "solver": "starting; the first start compiles for a minute",
}


@dataclass(frozen=True)
class Missing:
    """One thing that a rig lacks: who, why, and a kind that stays the same while the words of why
    change (a fault may count seconds).
    """

    who: str
    kind: str
    why: str


class Readiness:
    """What a rig still lacks. children are the names of the processes that run here."""

    def __init__(self, config: RigConfig, children: Sequence[str]) -> None:
        self.router = False
        self.viewer_port = 0
        self._children = [child for child in children if child != "router"]
        self._hosts = {camera.name: camera.host for camera in config.camera if camera.host}
        self._alive: set[Who] = set()
        self._health: dict[Who, Health] = {}

    def note_alive(self, change: Alive) -> None:
        """A service came or went."""
        who = (change.service, change.instance)
        if change.alive:
            self._alive.add(who)
        else:
            self._alive.discard(who)
            self._health.pop(who, None)

    def note_health(self, beat: Health) -> None:
        """A service told its health; strangers' are not kept."""
        who = (beat.service, beat.instance)
        if who in self._expected():
            self._health[who] = beat
        if beat.service == "viewer" and "viewer" in self._children:
            self.viewer_port = int(beat.values.get("port", 0))

    def missing(self, reasons: Mapping[str, str]) -> list[Missing]:
        """What is missing, and why; empty if the rig is up.

        reasons: why each child that has ended did so.
        """
        if not self.router:
            return [_absent("router", reasons)]
        local = [_absent(who, reasons) for who in self._children if _who(who) not in self._alive]
        return [*local, *self._remote(), *self._faults()]

    def _remote(self) -> Iterator[Missing]:
        """Trackers of other hosts that are not there."""
        for camera, host in self._hosts.items():
            if ("pi_tracker", camera) not in self._alive:
                why = f"not heard from {host}; `systemctl status rhot-pi-tracker@{camera}` there"
                yield Missing(f"pi_tracker/{camera}", "absent", f"{why} says why")

    def _faults(self) -> Iterator[Missing]:
        """What stops poses though all services run."""
        for (service, instance), beat in self._health.items():
            name = service if instance == "main" else f"{service}/{instance}"
            for fault in beat.faults:
                if fault.severity == "error" or fault.code in _STOPS_POSES:
                    why = f"{fault.text}; {fault.action} [{fault.code}]"
                    yield Missing(name, f"{fault.code} {fault.subject}", why)

    def _expected(self) -> set[Who]:
        trackers = {("pi_tracker", camera) for camera in self._hosts}
        return trackers | {_who(child) for child in self._children}


def _who(child: str) -> Who:
    """A child's name as its service and instance."""
    service, _, instance = child.partition("/")
    return service, instance or "main"


def _absent(child: str, reasons: Mapping[str, str]) -> Missing:
    why = reasons.get(child) or _STARTING.get(child, "starting")
    return Missing(child, why, why)
