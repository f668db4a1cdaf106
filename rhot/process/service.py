"""What a running service has at hand, and the health it tells of itself once a second."""

from __future__ import annotations

import asyncio
import logging
import os
import resource
import time
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.bus.stats import StreamStats
from rhot.files.config import RigConfig
from rhot.health_messages import Health, StreamHealth
from rhot.process import systemd
from rhot.process.fault_log import FaultLog

log = logging.getLogger("rhot.service")

# The first two beats after the start hold parts of a second; what they would say of rates is not
# true.
_SETTLE_S = 2.0
# One slow second is scheduling, three are a fault worth a line in the journal.
_SLOW_BEATS = 3
_PAGE_MB = resource.getpagesize() / 1e6


def rhot_version() -> str:
    """Installed version of rhot."""
    try:
        return version("rhot")
    except PackageNotFoundError:
        return "0+unknown"


@dataclass
class Service:
    """One process of the rig: its configuration, its bus, its tasks, its health."""

    name: str
    instance: str
    config: RigConfig
    bus: Bus
    tasks: asyncio.TaskGroup
    state: str = "starting"
    # What it does, in a few words for `systemctl status`; the state where that says enough.
    status: str = ""
    values: dict[str, float] = field(default_factory=dict)
    errors: int = 0
    faults: FaultLog = field(default_factory=lambda: FaultLog(clock.now_ns))
    _started_s: float = field(default_factory=time.monotonic)
    _ready_s: float = float("inf")
    _told_status: str = ""
    _slow_beats: dict[str, int] = field(default_factory=dict)

    def ready(self) -> None:
        """Initialised: tell systemd, and everybody who watches liveliness."""
        self.state = "running"
        self._ready_s = time.monotonic()
        self.bus.alive(self.name, self.instance)
        systemd.notify(f"READY=1\nSTATUS={self.state}")
        log.info("%s %s ready", self.name, self.instance)

    @property
    def last_error(self) -> str:
        """Text of the newest standing fault, "" if all is well."""
        standing = self.faults.standing()
        return max(standing, key=lambda fault: fault.since_ns).text if standing else ""

    def error(self, text: str, code: str = "event", subject: str | None = None) -> None:
        """Count an error that the service survives: something that happened, of any fault's code.

        It stands in health for half a minute after the last time (by its text, without a subject),
        and is one line in the journal however often it comes meanwhile. What lasts until it is
        mended is reported to `faults`.
        """
        self.errors += 1
        self.faults.event(code, text, text if subject is None else subject)

    async def beat(self) -> None:
        """Publish Health once a second, and log when a stream falls below its expected rate or
        recovers.
        """
        publisher = self.bus.publisher(topics.HEALTH, service=self.name, instance=self.instance)
        last_s, last_cpu_s = time.monotonic(), time.process_time()
        while True:
            await asyncio.sleep(1.0)
            now_s, cpu_s = time.monotonic(), time.process_time()
            elapsed_s = now_s - last_s
            streams = [
                stats.beat(elapsed_s, self._expected_hz(stats))
                for stats in self.bus.streams
                if stats.topic is not topics.HEALTH
            ]
            publisher.put(self._health(streams, 100.0 * (cpu_s - last_cpu_s) / elapsed_s))
            self._log_changes(streams)
            self._tell_status()
            last_s, last_cpu_s = now_s, cpu_s

    def _tell_status(self) -> None:
        status = self.status or self.state
        if status != self._told_status:
            self._told_status = status
            systemd.notify(f"STATUS={status}")

    def _health(self, streams: list[StreamHealth], cpu_percent: float) -> Health:
        return Health(
            service=self.name,
            instance=self.instance,
            stamp_ns=clock.now_ns(),
            version=rhot_version(),
            pid=os.getpid(),
            uptime_s=round(time.monotonic() - self._started_s, 1),
            state=self.state,
            streams=streams,
            errors=self.errors,
            last_error=self.last_error,
            faults=self.faults.standing(),
            cpu_percent=round(cpu_percent, 1),
            rss_mb=round(_rss_mb(), 1),
            values={
                name: round(value, 4) for name, value in self.values.items() if abs(value) < 1e300
            },
        )

    def _expected_hz(self, stats: StreamStats) -> float:
        """What the topics table and rig.toml lead to expect.

        Of a pattern, the sum over its streams.
        """
        if time.monotonic() - self._ready_s < _SETTLE_S:
            return 0.0
        rate = stats.topic.rate
        if "camera" in stats.topic.fields:
            cameras = (
                [stats.names["camera"]]
                if "camera" in stats.names
                else [c.name for c in self.config.camera]
            )
            return sum(self.config.rate_hz(rate, camera) for camera in cameras)
        many = {
            "hand": len(self.config.hand),
            "serial": len(self.config.object),
            "object": len(self.config.object),
        }
        streams = 1
        for field_name in stats.topic.fields:
            if field_name not in stats.names:
                streams *= many.get(field_name, 1)
        return self.config.rate_hz(rate) * streams

    def _log_changes(self, streams: list[StreamHealth]) -> None:
        text = "%s %s: %.1f Hz of %.1f expected, %d dropped, %d rejected"
        for stream in streams:
            slow_before = self._slow_beats.get(stream.key, 0)
            slow = 0 if stream.ok else slow_before + 1
            self._slow_beats[stream.key] = slow
            if slow == _SLOW_BEATS or (slow == 0 and slow_before >= _SLOW_BEATS):
                level = logging.WARNING if slow else logging.INFO
                log.log(
                    level,
                    text,
                    stream.direction,
                    stream.key,
                    stream.rate_hz,
                    stream.expected_hz,
                    stream.dropped,
                    stream.rejected,
                )


def _rss_mb() -> float:
    """Resident memory in MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * _PAGE_MB
