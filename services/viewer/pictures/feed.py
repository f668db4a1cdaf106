"""Camera pictures for the visitors who want them, and for nobody else.

A camera is subscribed to while at least one visitor shows it: it encodes none otherwise. What is no
JPEG is counted as an error and shown to nobody; what goes with a picture and is not what it should
be is counted, too, and the picture shown without.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE
from rhot.messages.camera import SeenInPicture
from rhot.process.service import Service

# JPEG files begin with this; other bytes are not sent to a browser.
_JPEG = b"\xff\xd8\xff"
# One being shown and the next; more would only be older.
_QUEUE = 2
# Called with a JPEG and what its tracker saw in it, None where it does not say.
Take = Callable[[bytes, SeenInPicture | None], None]
_SEEN = msgspec.json.Decoder(SeenInPicture)


class PictureFeed:
    """The pictures of all cameras of a rig."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._takers: dict[str, list[Take]] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def watch(self, camera: str, take: Take) -> Callable[[], None]:
        """Call take with each picture of a camera, until what is returned is called."""
        self._takers.setdefault(camera, []).append(take)
        if camera not in self._tasks:
            self._tasks[camera] = self._service.tasks.create_task(self._follow(camera))

        def stop() -> None:
            if take in self._takers.get(camera, []):
                self._takers[camera].remove(take)
            if not self._takers.get(camera) and camera in self._tasks:
                self._tasks.pop(camera).cancel()

        return stop

    async def _follow(self, camera: str) -> None:
        samples = self._service.bus.raw(topics.PREVIEW, _QUEUE, camera=camera)
        try:
            async for sample in samples:
                if not sample.payload.startswith(_JPEG):
                    self._service.error(f"{sample.key} carries no JPEG")
                    continue
                seen = self._decoded(sample.key, sample.attachment)
                for take in list(self._takers[camera]):
                    take(sample.payload, seen)
        finally:
            self._service.bus.close(samples)

    def _decoded(self, key: str, attachment: bytes) -> SeenInPicture | None:
        if not attachment:
            return None
        try:
            return _SEEN.decode(attachment)
        except UNDECODABLE as error:
            self._service.error(f"what goes with {key} cannot be read: {error}")
            return None
