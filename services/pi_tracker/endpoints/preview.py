"""The camera's pictures for people: JPEG while somebody watches, the last frame as PNG when asked.

Encoding runs in a worker thread: a preview never delays a marker. No frame yet: a request gets no
answer.
"""

from __future__ import annotations

import asyncio

import cv2

from rhot import topics
from rhot.bus.bus import Bus
from rhot.messages.camera import SeenInPicture
from services.pi_tracker.endpoints.shared_answer import SharedAnswer
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import bgr_image

# Previews are for people: 5 a second look alive and cost 2 % of a Pi's core each.
_PREVIEW_PERIOD_NS = 200_000_000
_JPEG_QUALITY = 80
# The page asks four times a second, a calibration as soon as it has an answer; a picture of 0.5 MB
# goes to few at a time, as answers wait in memory until the network has taken them.
_FRAME_PERIOD_S, _MOST_ASKERS = 0.05, 4
# PNG level 1: half the size of level 9's time budget is not worth a second of waiting for one
# frame.
_PNG_LEVEL = 1


def jpeg(frame: Frame) -> bytes:
    """The frame as JPEG."""
    return cv2.imencode(".jpg", bgr_image(frame), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[
        1
    ].tobytes()


def png(frame: Frame) -> bytes:
    """The frame as PNG, lossless in BGR."""
    return cv2.imencode(".png", bgr_image(frame), [cv2.IMWRITE_PNG_COMPRESSION, _PNG_LEVEL])[
        1
    ].tobytes()


class Preview:
    """Publishes previews and answers requests for frames of one camera."""

    def __init__(self, bus: Bus, camera: str, tasks: asyncio.TaskGroup) -> None:
        self._publisher = bus.publisher(topics.PREVIEW, camera=camera)
        self._tasks = tasks
        self._last: Frame | None = None
        self._sent_ns = 0
        self._busy = False
        self._frames = SharedAnswer(self._encoded, _FRAME_PERIOD_S, _MOST_ASKERS)
        # A coroutine function, so that it runs on the event loop.
        bus.answer(topics.FRAME, self._answer, camera=camera)

    def show(self, frame: Frame, now_ns: int, seen: SeenInPicture | None = None) -> None:
        """Remember the frame; send it, with what was seen in it, if a preview is wanted and due."""
        self._last = frame
        # A clock that was set back counts as due.
        if (
            self._busy
            or 0 <= now_ns - self._sent_ns < _PREVIEW_PERIOD_NS
            or not self._publisher.wanted
        ):
            return
        self._busy = True
        self._sent_ns = now_ns
        self._tasks.create_task(self._send(frame, seen))

    async def _send(self, frame: Frame, seen: SeenInPicture | None) -> None:
        try:
            self._publisher.put_bytes(await asyncio.to_thread(jpeg, frame), attachment=seen)
        finally:
            self._busy = False

    async def _answer(self) -> bytes | None:
        return await self._frames.get()

    async def _encoded(self) -> bytes | None:
        """The last frame as PNG, None if there is none yet."""
        return None if self._last is None else await asyncio.to_thread(png, self._last)
