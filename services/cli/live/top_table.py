"""The state of every service for `rhot top`, from health beats and liveliness tokens.

A service whose beat is missing for three seconds is `silent`, one whose token is gone is `gone`,
one that rig.toml expects and that never came is `absent`. Pure: time is an argument.
"""

from __future__ import annotations

import msgspec

from rhot import topics
from rhot.files.config import RigConfig
from rhot.health_messages import Health

# Three beats: one may be late, two may be lost.
_SILENT_NS = 3_000_000_000


class ServiceRow(msgspec.Struct, frozen=True, kw_only=True):
    """One service: its state, and its last health unless it is gone."""

    service: str
    instance: str
    state: str
    health: Health | None


class TopTable(msgspec.Struct, frozen=True, kw_only=True):
    """All services; glass_to_pose_ms: latency (p50, p99) from mid-exposure to pose, by hand."""

    rig: str
    services: list[ServiceRow]
    glass_to_pose_ms: dict[str, tuple[float, float]]

    @property
    def healthy(self) -> bool:
        """Every service is running, every stream at its rate."""
        return all(
            row.state == "running" and row.health and all(s.ok for s in row.health.streams)
            for row in self.services
        )


def expected_services(config: RigConfig) -> list[tuple[str, str]]:
    """(service, instance) of all that rig.toml calls for, without viewer and recorder."""
    expected = [("pi_tracker", camera.name) for camera in config.camera]
    expected += [("fusion", "main"), ("solver", "main")]
    if any(camera.source == "simulator" for camera in config.camera):
        expected.insert(0, ("simulator", "main"))
    return expected + ([("object_tracker", "main")] if config.object else [])


class ServiceMonitor:
    """Collects health beats and liveliness tokens into a TopTable."""

    def __init__(self, rig: str, expected: list[tuple[str, str]]) -> None:
        self._rig = rig
        self._expected = expected
        self._alive: dict[tuple[str, str], bool] = {}
        self._beats: dict[tuple[str, str], tuple[int, Health]] = {}

    def token(self, service: str, instance: str, alive: bool) -> None:
        """A service came or went."""
        self._alive[service, instance] = alive

    def beat(self, health: Health, now_ns: int) -> None:
        """A service's health arrived."""
        self._beats[health.service, health.instance] = (now_ns, health)

    def table(self, now_ns: int) -> TopTable:
        """The table as it stands: the expected services first, then the others by name."""
        names = list(dict.fromkeys([*self._expected, *sorted({*self._alive, *self._beats})]))
        rows = [self._row(service, instance, now_ns) for service, instance in names]
        return TopTable(rig=self._rig, services=rows, glass_to_pose_ms=_glass_to_pose(rows))

    def _row(self, service: str, instance: str, now_ns: int) -> ServiceRow:
        beat_ns, health = self._beats.get((service, instance), (0, None))
        if health is None and (service, instance) not in self._alive:
            state = "absent"
        elif not self._alive.get((service, instance), False) and (
            health is None or health.state == "running"
        ):
            state = "gone"
        elif health is None or now_ns - beat_ns > _SILENT_NS:
            state = "silent"
        else:
            state = health.state
        return ServiceRow(
            service=service,
            instance=instance,
            state=state,
            health=health if state != "gone" else None,
        )


def _glass_to_pose(rows: list[ServiceRow]) -> dict[str, tuple[float, float]]:
    latencies = {}
    for row in rows:
        for stream in row.health.streams if row.health else []:
            names = topics.POSE.names(stream.key)
            if stream.direction == "out" and names and stream.latency_p50_ms >= 0.0:
                latencies[names["hand"]] = (stream.latency_p50_ms, stream.latency_p99_ms)
    return latencies
