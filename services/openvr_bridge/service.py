"""The bridge's process: SteamVR -> step() -> poses and events on the bus.

It runs on the machine with SteamVR, Windows or Linux, which need not be the master; its clock is
compared with the master's as that of a Pi's is. SteamVR may come and go: it is tried again every
three seconds, and health says what is wrong meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable

from rhot import clock, topics
from rhot.bus.master_clock import follow_master
from rhot.clock import OffsetEstimator
from rhot.errors import SourceError
from rhot.messages.objects import OpenVrPose
from rhot.process.service import Service
from services.openvr_bridge.base_stations import BaseStations
from services.openvr_bridge.batteries import Batteries
from services.openvr_bridge.endpoints.own_name import check_clock, check_instance
from services.openvr_bridge.endpoints.streams import Streams
from services.openvr_bridge.sources.polling import Connection, Polling, polling
from services.openvr_bridge.sources.steamvr import SteamVr
from services.openvr_bridge.step import BridgeStep
from services.openvr_bridge.sweep import Sweep

log = logging.getLogger("rhot.openvr_bridge")

# SteamVR takes some seconds to start; trying is cheap.
_RETRY_S = 3.0
_LOOK_S = 1.0
_SUBJECT = "steamvr"
# Whether Valve's client always tells that its server has died is not documented: one without a
# single device for so long is connected anew, which takes a moment.
_ALONE_S = 30.0


async def serve(service: Service) -> None:
    """Sends what SteamVR tracks, from the machine that it runs on."""
    check_clock(time.get_clock_info("time").resolution)
    await asyncio.to_thread(check_instance, service.config, service.instance)
    bridge = Bridge(service)
    service.tasks.create_task(
        follow_master(service.bus, bridge.offset, clock.now_ns, service.second_clock)
    )
    service.ready()
    while True:
        try:
            await bridge.run(SteamVr)
        except SourceError as error:
            service.faults.report("source_lost", str(error), _SUBJECT)
            service.status = "waiting for SteamVR"
            await asyncio.sleep(_RETRY_S)


class Bridge:
    """One SteamVR after the other; offset is this machine's clock minus the master's."""

    def __init__(self, service: Service) -> None:
        self.offset = OffsetEstimator()
        self._service = service
        self._step = BridgeStep()
        self._streams = Streams(service)
        self._batteries, self._stations = Batteries(), BaseStations()
        self._events = service.bus.publisher(topics.OPENVR_EVENT, host=service.instance)
        self._slowest_s = 0.0

    async def run(self, connect: Callable[[], Connection]) -> None:
        """Send what one connection gives, until it fails (SourceError), is stuck (StuckError), or
        has had no device for long.
        """
        try:
            with polling(connect, self._service.config.objects.rate_hz) as poll:
                look_s, company_s = 0.0, time.monotonic()
                while time.monotonic() - company_s < _ALONE_S:
                    sweep = await poll.next()
                    if sweep.poses["bDeviceIsConnected"].any():
                        company_s = time.monotonic()
                    self._service.faults.clear("source_lost", _SUBJECT)
                    poses = self._take(sweep)
                    if time.monotonic() - look_s >= _LOOK_S:
                        look_s = time.monotonic()
                        self._look(sweep, poses, poll)
        finally:
            self._streams.close()
            for code in ("device_twice", "device_battery", "base_station_gone"):
                self._service.faults.replace(code, {})

    def _take(self, sweep: Sweep) -> list[OpenVrPose]:
        offset = self.offset.at(sweep.stamp_ns)
        for event in self._step.events(sweep, offset):
            log.info("SteamVR: %s %s", event.name, event.serial)
            self._events.put(event)
        poses = self._step.poses(sweep, offset)
        for pose in poses:
            self._streams.put(pose)
        self._slowest_s = max(self._slowest_s, sweep.took_s)
        return poses

    def _look(self, sweep: Sweep, poses: list[OpenVrPose], poll: Polling) -> None:
        """Faults and figures, once a second."""
        faults = self._service.faults
        offset = self.offset.at(sweep.stamp_ns)
        twice = {
            serial: f"devices {' and '.join(map(str, slots))} of SteamVR are both called {serial}"
            for serial, slots in self._step.twice.items()
        }
        faults.replace("device_twice", twice | self._streams.others(time.monotonic()))
        faults.replace("device_battery", self._batteries.texts(pose.device for pose in poses))
        moved, gone = self._stations.look(sweep)
        faults.replace("registration_stale", moved)
        faults.replace("base_station_gone", gone)
        tracked = sum(pose.bPoseIsValid and pose.bDeviceIsConnected for pose in poses)
        self._service.status = f"{tracked} of {len(poses)} devices tracked"
        self._service.values.update(
            devices=len(poses),
            tracked=tracked,
            poll_ms=1e3 * self._slowest_s,
            late_polls=poll.late,
            dropped_polls=poll.dropped,
            clock_offset_ms=offset.offset_ns * 1e-6,
            clock_sigma_ms=offset.sigma_ns * 1e-6 if offset.sigma_ns >= 0 else -1.0,
        )
        self._slowest_s = 0.0
