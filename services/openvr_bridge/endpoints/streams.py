"""The streams of the devices: a publisher for each serial, and an ear for others who send under it.

Two programs that read one tracker (a second bridge, libsurvive beside SteamVR) would make its pose
jump between their frames.
"""

from __future__ import annotations

import asyncio
import time

from rhot import topics
from rhot.bus.bus import Publisher
from rhot.bus.subscription import RawSubscription
from rhot.messages.objects import OpenVrPose
from rhot.process.service import Service

# Others who are silent for so long are gone.
_GONE_S = 3.0
# SteamVR has 64 slots; a source that names many more devices is broken.
_MAX_STREAMS = 128


class Streams:
    """What this bridge publishes, by serial."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._publishers: dict[str, Publisher[OpenVrPose]] = {}
        self._ears: dict[str, tuple[RawSubscription, asyncio.Task[None]]] = {}
        self._heard_s: dict[str, float] = {}

    def put(self, pose: OpenVrPose) -> None:
        """Publish a pose."""
        serial = pose.device.serial
        if serial not in self._publishers:
            if len(self._publishers) >= _MAX_STREAMS:
                text = f"SteamVR names more than {_MAX_STREAMS} devices; the others are left out"
                self._service.error(text)
                return
            self._open(serial)
        self._publishers[serial].put(pose)

    def others(self, now_s: float) -> dict[str, str]:
        """Serials under which somebody else publishes as well; now_s is time.monotonic()."""
        return {
            serial: f"another program publishes poses of {serial}, too"
            for serial, heard_s in self._heard_s.items()
            if now_s - heard_s < _GONE_S
        }

    def close(self) -> None:
        """End all streams: while SteamVR is away nobody expects them."""
        bus = self._service.bus
        for publisher in self._publishers.values():
            bus.close(publisher)
        for subscription, task in self._ears.values():
            task.cancel()
            bus.close(subscription)
        self._publishers.clear()
        self._ears.clear()
        self._heard_s.clear()

    def _open(self, serial: str) -> None:
        bus = self._service.bus
        self._publishers[serial] = bus.publisher(topics.OPENVR, serial=serial)
        ear = bus.others(topics.OPENVR, 1, serial=serial)
        self._ears[serial] = ear, self._service.tasks.create_task(self._listen(serial, ear))

    async def _listen(self, serial: str, ear: RawSubscription) -> None:
        async for _ in ear:
            self._heard_s[serial] = time.monotonic()
