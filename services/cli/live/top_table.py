"""What `rhot top` shows, from health beats and liveliness. Pure: time is an argument.

A service whose beat is missing for three seconds is `silent`, one whose token is gone is `gone`,
one that rig.toml expects and that never came is `absent`.
"""

from __future__ import annotations

import msgspec

from rhot import topics
from rhot.files.config import RigConfig
from rhot.messages import Health, StreamHealth

# Three beats: one may be late, two may be lost.
_SILENT_NS = 3_000_000_000


class ServiceRow(msgspec.Struct, frozen=True, kw_only=True):
    """One service: what it says of itself, and whether it still says anything."""

    service: str
    instance: str
    state: str
    health: Health | None


class Board(msgspec.Struct, frozen=True, kw_only=True):
    """The whole table; glass_to_pose is (p50, p99) in ms by hand."""

    rig: str
    services: list[ServiceRow]
    glass_to_pose_ms: dict[str, tuple[float, float]]

    @property
    def healthy(self) -> bool:
        """Every service running, every stream at its rate."""
        return all(
            row.state == "running" and row.health and all(s.ok for s in row.health.streams)
            for row in self.services
        )


def expected_services(config: RigConfig) -> list[tuple[str, str]]:
    """(service, instance) of everything rig.toml calls for, viewer and recorder left to the user."""
    expected = [("pi_tracker", camera.name) for camera in config.camera] + [
        ("fusion", "main"),
        ("solver", "main"),
    ]
    if any(camera.source == "simulator" for camera in config.camera):
        expected.insert(0, ("simulator", "main"))
    return expected + ([("object_tracker", "main")] if config.object else [])


class Watcher:
    """Collects beats and tokens into a Board."""

    def __init__(self, rig: str, expected: list[tuple[str, str]]) -> None:
        self._rig = rig
        self._alive: dict[tuple[str, str], bool] = {}
        self._beats: dict[tuple[str, str], tuple[int, Health]] = {}
        self._expected = expected

    def token(self, service: str, instance: str, alive: bool) -> None:
        """A service came or went."""
        self._alive[service, instance] = alive

    def beat(self, health: Health, now_ns: int) -> None:
        """A service's health arrived."""
        self._beats[health.service, health.instance] = (now_ns, health)

    def board(self, now_ns: int) -> Board:
        """The table as it stands."""
        names = list(dict.fromkeys([*self._expected, *sorted({*self._alive, *self._beats})]))
        rows = [self._row(service, instance, now_ns) for service, instance in names]
        return Board(rig=self._rig, services=rows, glass_to_pose_ms=_glass_to_pose(rows))

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


def text(board: Board) -> str:
    """The table for people."""
    lines = [
        f"rig {board.rig}",
        f"{'service':<24} {'state':<10} {'up s':>7} {'cpu %':>6} {'MB':>6} {'errors':>6}",
    ]
    for row in board.services:
        lines.append(_service_line(row))
        lines += [_stream_line(stream) for stream in (row.health.streams if row.health else [])]
        if row.health and row.health.last_error:
            lines.append(f"    last error: {row.health.last_error}")
    for hand, (p50_ms, p99_ms) in board.glass_to_pose_ms.items():
        lines.append(f"glass to {hand} pose: p50 {p50_ms:.1f} ms, p99 {p99_ms:.1f} ms")
    return "\n".join(lines)


def _service_line(row: ServiceRow) -> str:
    name = f"{row.service}/{row.instance}"
    if row.health is None:
        return f"{name:<24} {row.state:<10}"
    h = row.health
    return f"{name:<24} {row.state:<10} {h.uptime_s:>7.0f} {h.cpu_percent:>6.1f} {h.rss_mb:>6.0f} {h.errors:>6}"


def _stream_line(stream: StreamHealth) -> str:
    key = stream.key.split("/", 2)[-1]
    rate = f"{stream.rate_hz:6.1f} Hz" + (
        f" of {stream.expected_hz:g}" if stream.expected_hz else ""
    )
    latency = (
        f"p50 {stream.latency_p50_ms:.1f} p99 {stream.latency_p99_ms:.1f} ms"
        if stream.latency_p50_ms >= 0.0
        else ""
    )
    what = "age" if stream.direction == "out" else "hop"
    flag = " " if stream.ok else "!"
    losses = (
        f"dropped {stream.dropped} rejected {stream.rejected}"
        if stream.dropped or stream.rejected
        else ""
    )
    return f"  {flag} {stream.direction:<3} {key:<32} {rate:<18} {what + ' ' + latency if latency else '':<30} {losses}".rstrip()
