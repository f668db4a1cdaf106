"""A fault, planted into a rig that is well, and what it cost until all was well again."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

from testing.hosts.container import Container
from testing.hosts.fault_table import FaultRow, FaultTable
from testing.hosts.hosted_rig import HostedRig
from testing.hosts.poses import PoseWatch

# What is not back by then hangs: a machine that does much else may take ten times what is wanted.
HANG_S = 60.0


@dataclass
class Planted:
    """One fault while it lasts; the test says what it did.

    cured_s is when whoever planted it took it away (a cable in again); times count from there.
    services are units that must be ready again, each with its host.
    """

    began_s: float = field(default_factory=time.monotonic)
    cured_s: float | None = None
    services: list[tuple[Container, str]] = field(default_factory=list)

    def cured(self) -> None:
        """The fault is over from now on; what follows is recovery."""
        self.cured_s = time.monotonic()


@contextlib.contextmanager
def planted(
    rig: HostedRig, watch: PoseWatch, table: FaultTable, name: str, wanted_s: float | None
) -> Iterator[Planted]:
    """Plant a fault inside the block; afterwards everything has HANG_S to come back.

    Adds a row to the table. Raises AssertionError with the journals if something hangs.
    """
    assert watch.wait_first(HANG_S) is not None, f"the rig was not well before\n{rig.journals()}"
    restarts = rig.restarts()
    fault = Planted()
    yield fault
    back_s = watch.wait_back(fault.began_s, HANG_S)
    ready_s = [_wait_ready(host, unit, fault.began_s) for host, unit in fault.services]
    from_s = fault.began_s if fault.cured_s is None else fault.cured_s
    hung = back_s is None or None in ready_s
    told = [at_s - from_s for at_s in ready_s if at_s is not None]
    table.rows.append(
        FaultRow(
            fault=name,
            counts_from="the fault" if fault.cured_s is None else "its end",
            poses_s=None if back_s is None else round(max(0.0, back_s - from_s), 3),
            wanted_s=wanted_s,
            service_s=round(max(0.0, *told), 3) if told else None,
            restarts=max(0, rig.restarts() - restarts),
            wrong_poses=sum(pose.live and pose.wrong for pose in watch.since(fault.began_s)),
            hung=hung,
        )
    )
    assert not hung, f"{name}: not back within {HANG_S} s\n{rig.journals()}"


def _wait_ready(host: Container, unit: str, since_s: float) -> float | None:
    """When a unit became active after an instant (CLOCK_MONOTONIC); None: it did not in time."""
    deadline_s = time.monotonic() + HANG_S
    while time.monotonic() < deadline_s:
        shown = host.show(unit, "ActiveState", "ActiveEnterTimestampMonotonic")
        entered_s = int(shown["ActiveEnterTimestampMonotonic"] or 0) * 1e-6
        if shown["ActiveState"] == "active" and entered_s > since_s:
            return entered_s
        time.sleep(0.1)
    return None
