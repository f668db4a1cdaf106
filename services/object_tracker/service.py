"""The object tracker: tracker poses as OpenVR reports them in, object poses in the rig frame out.

Poses come from a source of its own (steamvr, libsurvive, replay) or from elsewhere on the bus
(simulator, network). Either way they are published on the openvr topic, so that they can be seen
and recorded. Late: each pose keeps its own stamp. Missing: nothing is published. Uncalibrated:
poses stay in the lighthouse frame with registered = false, and health says so.
"""

from __future__ import annotations

import contextlib

from rhot import topics
from rhot.bus.bus import Publisher
from rhot.messages import OpenVrPose
from rhot.process.service import Service
from services.object_tracker.registration import load_registration
from services.object_tracker.sources import PoseSource, open_source
from services.object_tracker.step import ObjectStep

# OpenVR has 64 device slots; a source that names more devices is broken.
_MAX_DEVICES = 64


async def serve(service: Service) -> None:
    """Tracks the objects that rig.toml names, from SteamVR, libsurvive, a file or the bus."""
    step = ObjectStep(service.config, load_registration(service.config))
    if not step.registered and service.config.object:
        service.error(
            "no calibration/objects.json: poses stay in the lighthouse frame;"
            " run `rhot calibrate objects`"
        )
    source = open_source(service.config, service.error)
    publishers = {
        o.name: service.bus.publisher(topics.OBJECT, object=o.name) for o in service.config.object
    }
    poses = service.bus.every(topics.OPENVR, 64)
    if source is not None:
        service.tasks.create_task(_publish_source(service, source))
    service.ready()
    async for pose in poses:
        result = step.step(pose)
        if result is not None:
            publishers[result.object].put(result)
        elif step.unknown == 1:
            service.error(
                f"device {pose.device.serial} is none of rig.toml's [[object]] tables;"
                " its poses are ignored (and counted)"
            )
        service.values.update(
            registered=float(step.registered), lost=step.lost, unknown=step.unknown
        )


async def _publish_source(service: Service, source: PoseSource) -> None:
    """Publish the poses of a source, one stream for each device."""
    publishers: dict[str, Publisher[OpenVrPose]] = {}
    async with contextlib.aclosing(source.poses()) as poses:
        async for pose in poses:
            serial = pose.device.serial
            if serial not in publishers:
                if len(publishers) >= _MAX_DEVICES:
                    service.error(
                        f"the source names more than {_MAX_DEVICES} devices; {serial} is left out"
                    )
                    continue
                publishers[serial] = service.bus.publisher(topics.OPENVR, serial=serial)
            publishers[serial].put(pose)
