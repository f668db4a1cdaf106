"""The recorder: everything the topics table marks as recorded, into one MCAP file a session.

Late or missing streams are recorded late or not at all. A full disk, or a folder that cannot be
written, ends the service with a clear error. When it starts it restores recordings that were cut
off by a crash.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.bus.subscription import RawSubscription
from rhot.errors import CaptureError
from rhot.files.config import RigConfig
from rhot.process.service import Service, rhot_version
from rhot.topics import Topic
from services.recorder.recorder import Recorder, recorded_topics
from services.recorder.recover import recover, truncated_recordings

# Samples of a topic that wait while a chunk is compressed and written (some ms): ten seconds of a
# camera, and no memory to speak of.
QUEUE = 512
_FLUSH_S = 1.0


async def serve(service: Service) -> None:
    """Records every session (or all the time: [recorder] autostart) into [recorder] folder."""
    config = service.config
    folder = Path(config.folder) / config.recorder.folder
    for note in await asyncio.to_thread(recover_all, folder):
        service.error(note)
    recorder = Recorder(config, folder, rhot_version())
    try:
        if config.recorder.autostart:
            recorder.start(clock.now_ns())
        subscriptions = subscribe(service.bus, config)
        for session in await service.bus.get(topics.SESSION):
            recorder.follow(session)
        service.ready()
        async with asyncio.TaskGroup() as tasks:
            for topic, samples in subscriptions:
                tasks.create_task(record_topic(recorder, topic, samples))
            tasks.create_task(_flush_and_report(service, recorder))
    finally:
        recorder.stop()


def subscribe(bus: Bus, config: RigConfig) -> list[tuple[Topic, RawSubscription]]:
    """Subscriptions to everything that is recorded."""
    return [(topic, bus.raw(topic, QUEUE)) for topic in recorded_topics(config)]


async def record_topic(recorder: Recorder, topic: Topic, samples: RawSubscription) -> None:
    """Record every sample of a topic, for ever; raises CaptureError when one cannot be kept."""
    async for sample in samples:
        recorder.add(topic, sample.key, sample.payload, sample.received_ns)


def recover_all(folder: Path) -> list[str]:
    """Restore the truncated recordings of a folder; returns a note for each.

    Files without any readable message are noted too, and left.
    """
    notes = []
    for path in truncated_recordings(folder):
        try:
            done = recover(path)
            notes.append(
                f"{path.name} had been cut off:"
                f" {done.messages} messages restored to {done.target.name}"
            )
        except CaptureError as error:
            notes.append(str(error))
    return notes


async def _flush_and_report(service: Service, recorder: Recorder) -> None:
    """Keep the file and the service's health up to date, for ever."""
    while True:
        await asyncio.sleep(_FLUSH_S)
        recorder.flush()
        service.values.update(
            recording=float(recorder.path is not None),
            messages=recorder.messages,
            megabytes=recorder.bytes / 1e6,
        )
        if recorder.refused > service.values.get("refused", 0):
            service.error(
                f"{recorder.refused} messages on too many different keys were not recorded"
            )
            service.values["refused"] = recorder.refused
