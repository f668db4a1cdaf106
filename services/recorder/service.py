"""The recorder: everything the topics table marks as recorded, into one MCAP file a session.

Late or missing streams are recorded late or not at all. While the disk is full nothing is recorded,
and health says so; once there is space it goes on in a new file. A folder that cannot be written
ends the service with a clear error. When it starts it restores recordings that were cut off by a
crash.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.bus.subscription import RawSubscription
from rhot.errors import CaptureError, DiskFullError, RefusedError
from rhot.files.config import RigConfig
from rhot.messages import Session
from rhot.messages.recording import RecorderState, replay_rig
from rhot.process.service import Service, rhot_version
from rhot.topics import Topic
from services.recorder.endpoints.deck import Deck
from services.recorder.endpoints.library import Library
from services.recorder.endpoints.requests import Requests
from services.recorder.recorder import Recorder, recorded_topics
from services.recorder.recover import recover, truncated_recordings

# Samples of a topic that wait while a chunk is compressed and written (some ms): ten seconds of a
# camera, and no memory to speak of.
QUEUE = 512
# What a recorder loses that is killed.
_FLUSH_S = 0.5
# Between two tries to go on after a full disk; each opens a file.
_RESUME_S = 5.0
# Samples that are dropped stand in health for so long after the last one.
_BEHIND_S = 10.0
Subscriptions = list[tuple[Topic, RawSubscription]]


async def serve(service: Service) -> None:
    """Records every session (or all the time: [recorder] autostart) into [recorder] folder."""
    await _serve(service, on_request=False)


async def serve_on_request(service: Service) -> None:
    """Records what it is asked for (or all the time: [recorder] autostart)."""
    await _serve(service, on_request=not service.config.recorder.autostart)


async def _serve(service: Service, *, on_request: bool) -> None:
    config = service.config
    folder = Path(config.folder) / config.recorder.folder
    for note in await asyncio.to_thread(recover_all, folder):
        service.error(note)
    recorder = Recorder(config, folder, rhot_version(), follow_sessions=not on_request)
    keeper = _Keeper(service, recorder)
    deck = Deck(service.bus, replay_rig(config.rig.name))
    try:
        if config.recorder.autostart:
            keeper.start()
        if not on_request:
            keeper.listen()
            for session in await service.bus.get(topics.SESSION):
                keeper.follow(session)
        Requests(deck, Library(folder), keeper).answer_on(service.bus)
        service.ready()
        await keeper.look_regularly()
    finally:
        await deck.close()
        keeper.deafen()
        recorder.stop()


def subscribe(bus: Bus, config: RigConfig) -> Subscriptions:
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


class _Keeper:
    """A recorder as a service: it survives a full disk, and tells of what it could not keep."""

    def __init__(self, service: Service, recorder: Recorder) -> None:
        self.recorder = recorder
        self._service = service
        self._refused = self._postponed = self._dropped = 0
        self._tried_s = 0.0
        # What is listened to, and who does; the samples that were dropped before.
        self._subscriptions: Subscriptions = []
        self._listeners: list[asyncio.Task[None]] = []
        self._dropped_before = 0
        # What the counts were when the recording was asked for, and when that was.
        self._asked = (0, 0)
        self._asked_ns = 0

    def listen(self) -> None:
        """Take all samples from now on."""
        if not self._subscriptions:
            self._subscriptions = subscribe(self._service.bus, self._service.config)
            self._listeners = [
                self._service.tasks.create_task(self.record_topic(topic, samples))
                for topic, samples in self._subscriptions
            ]

    def deafen(self) -> None:
        """Take none: what nobody records shall cost nothing."""
        self._dropped_before = self._dropped_in_all()
        for listener in self._listeners:
            listener.cancel()
        for _, samples in self._subscriptions:
            self._service.bus.close(samples)
        self._subscriptions, self._listeners = [], []

    def _dropped_in_all(self) -> int:
        now = sum(samples.stats.dropped_in_all for _, samples in self._subscriptions)
        return self._dropped_before + now

    def record(self) -> None:
        """Record until stop(), because somebody asked for it."""
        recorder = self.recorder
        if recorder.path is not None:
            raise RefusedError(f"{recorder.path.name} is being recorded already", "busy")
        self._asked, self._asked_ns = (recorder.messages, recorder.bytes), clock.now_ns()
        recorder.start(self._asked_ns)
        self.listen()

    def stop(self) -> None:
        """End the recording, because somebody asked for it."""
        if self.recorder.path is None and not self.recorder.suspended:
            raise RefusedError("nothing is being recorded", "invalid")
        self.recorder.stop()
        if not self.recorder.follows_sessions:
            self.deafen()

    def state(self) -> RecorderState:
        """What is being recorded, for who asks."""
        recorder = self.recorder
        path = recorder.path
        if path is None:
            return RecorderState()
        messages, size = self._asked
        return RecorderState(
            file=path.name,
            since_ns=self._asked_ns,
            messages=recorder.messages - messages,
            size_mb=round((recorder.bytes - size) / 1e6, 3),
        )

    def start(self) -> None:
        """Record from now on."""
        try:
            self.recorder.start(clock.now_ns())
        except DiskFullError as error:
            self._suspend(error)

    def follow(self, session: Session) -> None:
        """Record that session, if it runs."""
        try:
            self.recorder.follow(session, clock.now_ns())
        except DiskFullError as error:
            self._suspend(error)

    async def record_topic(self, topic: Topic, samples: RawSubscription) -> None:
        """Record every sample of a topic, for ever; while the disk is full, lose it."""
        while True:
            try:
                await record_topic(self.recorder, topic, samples)
                return
            except DiskFullError as error:
                self._suspend(error)

    def _suspend(self, error: DiskFullError) -> None:
        self.recorder.suspend()
        self._tried_s = asyncio.get_running_loop().time()
        self._service.state = "waiting"
        self._service.faults.report("disk_full", error.cause, str(self.recorder.folder))

    async def look_regularly(self) -> None:
        """Keep the file and the service's health up to date, for ever."""
        while True:
            await asyncio.sleep(_FLUSH_S)
            try:
                self._flush_or_resume()
            except DiskFullError as error:
                self._suspend(error)
            self._report(self._dropped_in_all())

    def _flush_or_resume(self) -> None:
        recorder = self.recorder
        if not recorder.suspended:
            recorder.flush(clock.now_ns())
        elif asyncio.get_running_loop().time() - self._tried_s >= _RESUME_S:
            recorder.resume(clock.now_ns())
            self._service.state = "running"
            self._service.faults.clear("disk_full", str(recorder.folder))

    def _report(self, dropped: int) -> None:
        recorder, faults = self.recorder, self._service.faults
        self._service.values.update(
            recording=float(recorder.path is not None),
            messages=recorder.messages,
            megabytes=recorder.bytes / 1e6,
            refused=recorder.refused,
            lost=recorder.lost + dropped,
        )
        if dropped > self._dropped:
            text = f"{dropped} messages were lost, as the recorder could not keep up"
            faults.event("recorder_behind", text, for_s=_BEHIND_S)
        if recorder.refused > self._refused:
            text = f"{recorder.refused} messages under unknown names were not recorded"
            faults.event("names_flooded", text)
        if recorder.postponed > self._postponed:
            text = "sessions start and stop faster than people do: they share a recording"
            faults.event("request_refused", text, "session")
        self._dropped, self._refused = dropped, recorder.refused
        self._postponed = recorder.postponed
