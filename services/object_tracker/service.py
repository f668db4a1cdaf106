"""The object tracker: tracker poses as OpenVR reports them in, object poses in the rig frame out.

Poses come from a source of its own (libsurvive, replay) or from elsewhere on the bus (the bridge to
SteamVR, simulator, network). Either way they are published on the openvr topic, so that they can be
seen and recorded. Late: each pose keeps its own stamp; one older than the last is left out, and
counted. Missing: a device that has stopped is "lost", told once a second until it is back. A source
that fails is tried again, and health says why. Uncalibrated, or in another universe than
registered: poses stay in the lighthouse frame with registered = false, and health says so; with a
new objects.json the service starts anew.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable

from rhot import clock, topics
from rhot.bus.bus import Publisher
from rhot.bus.subscription import Subscription
from rhot.errors import SourceError
from rhot.messages.objects import ObjectPose, OpenVrEvent, OpenVrPose
from rhot.process.calibration_watch import load_and_watch
from rhot.process.service import Service
from services.object_tracker.contacts.service import start_contacts
from services.object_tracker.drift import camera_files, open_drift
from services.object_tracker.registration import load_registration
from services.object_tracker.sources import PoseSource, open_source
from services.object_tracker.sources.retry_pause import RetryPause
from services.object_tracker.step import ObjectStep
from services.object_tracker.unknown_devices import UnknownDevices

# OpenVR has 64 device slots; a source that names more devices is broken.
_MAX_DEVICES = 64
_LOOK_S = 1.0
# Poses that may wait: a second of 16 trackers at 250 Hz, for when something else takes the
# processor. 1024 lost 4 % on a machine that had twice as much to do as it can.
_QUEUE = 4096


async def serve(service: Service) -> None:
    """Tracks the objects that rig.toml names, from libsurvive, a file or the bus."""
    config = service.config
    path = config.calibration_dir / "objects.json"
    files = [path, *camera_files(config)]
    step = load_and_watch(service, files, lambda: ObjectStep(config, load_registration(config)))
    if not step.registered and config.object:
        names = ", ".join(item.name for item in config.object)
        text = f"no calibration/objects.json: poses of {names} stay in the lighthouse frame"
        service.faults.report("object_unregistered", text)
    source = open_source(config)
    outlet = Outlet(service)
    await start_contacts(service, outlet.consumers)
    poses = service.bus.every(topics.OPENVR, _QUEUE, [item.serial for item in config.object])
    events = service.bus.every(topics.OPENVR_EVENT, 64)
    unknown = UnknownDevices()
    service.values.update(step.values())
    if source is not None:
        service.tasks.create_task(_keep_source(service, source))
    service.tasks.create_task(_hear_events(service, step, events))
    service.tasks.create_task(_look_after(service, step, outlet, unknown))
    if drift := open_drift(service, step.correct):
        outlet.consumers.append(drift.take)
        service.tasks.create_task(drift.follow())
    service.ready()

    def take(pose: OpenVrPose) -> None:
        result = step.step(pose, clock.now_ns())
        if result is not None:
            outlet.put(result)
        elif config.object and not step.knows(pose.device.serial):
            unknown.note(pose.device.serial, time.monotonic())

    await poses.each(take)


class Outlet:
    """Where every ObjectPose goes: onto the bus, and to who watches objects in this process."""

    def __init__(self, service: Service) -> None:
        self._publishers = {
            item.name: service.bus.publisher(topics.OBJECT, object=item.name)
            for item in service.config.object
        }
        # Called with each published pose, in this order; quick, and without exceptions.
        self.consumers: list[Callable[[ObjectPose], None]] = []

    def put(self, pose: ObjectPose) -> None:
        """Publish a pose, and show it to the consumers."""
        self._publishers[pose.object].put(pose)
        for consumer in self.consumers:
            consumer(pose)


async def _hear_events(
    service: Service, step: ObjectStep, events: Subscription[OpenVrEvent]
) -> None:
    """Take in what SteamVR says of its frame, for ever."""
    async for event in events:
        warning = step.event(event)
        if warning is not None:
            service.error(warning, subject="openvr")


async def _look_after(
    service: Service, step: ObjectStep, outlet: Outlet, unknown: UnknownDevices
) -> None:
    """Once a second: the devices that have stopped, what is wrong, and the counts; for ever."""
    while True:
        await asyncio.sleep(_LOOK_S)
        now_ns = clock.now_ns()
        for lost in step.silent(now_ns):
            outlet.put(lost)
        for code, texts in step.faults(now_ns).items():
            service.faults.replace(code, texts)
        service.faults.replace("device_unknown", unknown.texts(time.monotonic()))
        service.values.update(step.values())


async def _keep_source(service: Service, source: PoseSource) -> None:
    """Publish the poses of a source; one that fails is tried again, a file ends in peace."""
    pause = RetryPause()
    while True:
        try:
            await _publish_source(service, source, pause)
            return
        except SourceError as error:
            service.faults.report("source_lost", str(error), service.config.objects.source)
            await asyncio.sleep(pause.after_failure())


async def _publish_source(service: Service, source: PoseSource, pause: RetryPause) -> None:
    """Publish the poses of a source, one stream for each device."""
    publishers: dict[str, Publisher[OpenVrPose]] = {}
    async with contextlib.aclosing(source.poses()) as poses:
        async for pose in poses:
            service.faults.clear("source_lost", service.config.objects.source)
            pause.succeeded()
            serial = pose.device.serial
            if serial not in publishers:
                if len(publishers) >= _MAX_DEVICES:
                    service.error(
                        f"the source names more than {_MAX_DEVICES} devices; the others are left"
                        " out"
                    )
                    continue
                publishers[serial] = service.bus.publisher(topics.OPENVR, serial=serial)
            publishers[serial].put(pose)
