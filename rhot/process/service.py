"""What a running service has at hand, and the health it tells of itself once a second."""

from __future__ import annotations

import asyncio
import functools
import gc
import logging
import mmap
import os
import re
import socket
import time
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.bus.stats import StreamStats
from rhot.bus.subscription import Subscription
from rhot.files.config import RigConfig
from rhot.messages import Session
from rhot.messages.health import Health, StreamHealth
from rhot.process import systemd
from rhot.process.fault_log import FaultLog
from rhot.process.health.namesakes import Namesakes
from rhot.process.health.slow_streams import SlowStreams
from rhot.process.rigs.turns import until_turn_s

log = logging.getLogger("rhot.service")

# Health is told this often.
_BEAT_S = 1.0
# The first two beats after the start hold parts of a second; what they would say of rates is not
# true.
_SETTLE_S = 2.0
# Of these a rig has one, whatever their instance is called; of others one of each instance.
_ONE_OF_A_KIND = {"fusion", "solver", "object_tracker", "simulator"}
# How often is asked whether the session runs, while streams are slow and no broadcast says why.
_ASK_SESSION_S = 5.0
_PAGE_MB = mmap.PAGESIZE / 1e6


@functools.cache
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
    _slow: SlowStreams = field(default_factory=SlowStreams)
    _session_running: bool = True

    def __post_init__(self) -> None:
        self.host = re.sub(r"[^A-Za-z0-9_.-]", "_", socket.gethostname())[:64]
        self._namesakes = Namesakes(self.bus.session)

    @property
    def uptime_s(self) -> float:
        """Since this service was made."""
        return time.monotonic() - self._started_s

    def ready(self) -> None:
        """Initialised: tell systemd, and everybody who watches liveliness.

        What there is by now stays: the garbage collector need not look through it again, which
        stops a service with numba for tens of milliseconds.
        """
        gc.collect()
        gc.freeze()
        self.state = "running"
        self._ready_s = time.monotonic()
        self.bus.alive(self.name, self.instance)
        systemd.notify("READY=1")
        systemd.tell_status(self.state)
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

    async def turn(self, period_s: float) -> None:
        """Wait until this rig is to do again what every rig of this process does every period_s."""
        await asyncio.sleep(until_turn_s(self.config.rig.name, period_s, time.monotonic()))

    def second_clock(self, text: str | None) -> None:
        """Report that more than one master answers, or with None that one does."""
        self.faults.replace("second_clock", {} if text is None else {"": text})

    async def beat(self) -> None:
        """Publish Health once a second; report streams that are below their expected rate, and
        another service of the same name.
        """
        publisher = self.bus.publisher(topics.HEALTH, service=self.name, instance=self.instance)
        last_s, last_cpu_s = time.monotonic(), time.process_time()
        while True:
            await self.turn(_BEAT_S)
            now_s, cpu_s = time.monotonic(), time.process_time()
            elapsed_s = now_s - last_s
            told = [stats for stats in self.bus.streams if stats.topic is not topics.HEALTH]
            streams = [stats.beat(elapsed_s, self._expected_hz(stats)) for stats in told]
            steady = [s for s, stats in zip(streams, told, strict=True) if _is_steady(stats)]
            self._find_faults(steady)
            publisher.put(self._health(streams, 100.0 * (cpu_s - last_cpu_s) / elapsed_s))
            self._tell_status()
            last_s, last_cpu_s = now_s, cpu_s

    async def listen(self) -> None:
        """Hear what a service must know beside its own streams, for ever: others of its name, and
        whether the session runs.
        """
        names = {} if self.name in _ONE_OF_A_KIND else {"instance": self.instance}
        beats = self.bus.every(topics.HEALTH, 16, service=self.name, **names)
        broadcasts = self.bus.latest(topics.SESSION)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._ask_session())
            tasks.create_task(self._hear_namesakes(beats))
            async for session in broadcasts:
                self._take_session(session)

    async def _hear_namesakes(self, beats: Subscription[Health]) -> None:
        async for beat in beats:
            self._namesakes.note(beat, time.monotonic())

    async def _ask_session(self) -> None:
        """A broadcast that was missed is asked for, once it would explain something."""
        while True:
            await asyncio.sleep(_ASK_SESSION_S)
            if self._slow.any_slow or not self._session_running:
                for session in await self.bus.get(topics.SESSION):
                    self._take_session(session)

    def _take_session(self, session: Session) -> None:
        if session.running and not self._session_running:
            # Streams begin anew, and so does the time they are given for it.
            self._ready_s = time.monotonic()
        self._session_running = session.running

    def _find_faults(self, streams: list[StreamHealth]) -> None:
        texts = self._namesakes.texts(self.config.rig.name, self.uptime_s, time.monotonic())
        self.faults.replace("second_service", texts)
        self.faults.replace("stream_slow", self._slow.beat(streams))

    def _tell_status(self) -> None:
        """`systemctl status` shows the state, and what is wrong."""
        texts = [fault.text for fault in self.faults.standing()]
        status = "; ".join([self.status or self.state, *texts])
        if status != self._told_status:
            self._told_status = status
            systemd.tell_status(status)

    def _health(self, streams: list[StreamHealth], cpu_percent: float) -> Health:
        return Health(
            service=self.name,
            instance=self.instance,
            stamp_ns=clock.now_ns(),
            version=rhot_version(),
            pid=os.getpid(),
            host=self.host,
            session=self.bus.session,
            uptime_s=round(self.uptime_s, 1),
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

        Of a pattern, the sum over its streams; nothing at first, nor while the session is stopped.
        """
        settling = time.monotonic() - self._ready_s < _SETTLE_S
        if settling or not self._session_running:
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


def _is_steady(stats: StreamStats) -> bool:
    """Whether silence of a stream is a fault; there is no pose of a hand that nobody holds up, and
    no contact of an object without a shape or a hand.
    """
    return stats.topic not in (topics.POSE, topics.CONTACTS)


def _rss_mb() -> float:
    """Resident memory in MB; 0 on Windows, which does not tell it in a file."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * _PAGE_MB
    except FileNotFoundError:
        return 0.0
