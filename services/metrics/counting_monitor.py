"""A RigMonitor that also adds up what each beat counts, as Prometheus wants its counters. Pure."""

from __future__ import annotations

from collections import Counter

from rhot.files.config import RigConfig
from rhot.messages.health import Health
from rhot.watch.rig_monitor import RigMonitor

# A rig of two Pis has some thirty streams; keys come from the network, memory must not.
_MAX_STREAMS = 512

StreamName = tuple[str, str, str, str]  # service, instance, direction, key


class CountingMonitor(RigMonitor):
    """Messages, drops and rejections of each stream since this monitor began."""

    def __init__(self, config: RigConfig, now_ns: int) -> None:
        super().__init__(config, now_ns)
        self.messages: Counter[StreamName] = Counter()
        self.dropped: Counter[StreamName] = Counter()
        self.rejected: Counter[StreamName] = Counter()

    def beat(self, health: Health, now_ns: int) -> None:
        """A service's health arrived, with what it counted in the last second."""
        super().beat(health, now_ns)
        for stream in health.streams:
            name = (health.service, health.instance, stream.direction, stream.key)
            if name in self.messages or len(self.messages) < _MAX_STREAMS:
                self.messages[name] += stream.count
                self.dropped[name] += stream.dropped
                self.rejected[name] += stream.rejected
