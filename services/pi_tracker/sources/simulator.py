"""The simulator's frames as a source: I420 images over the bus.

Their stamps are on a simulated camera computer's clock. Frames that come faster than they are used
are dropped, oldest first. While there is no simulator nothing comes, and nothing fails. An
attachment or payload that is not what it should be is rejected and counted.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator

import msgspec
import numpy as np

from rhot import clock, topics
from rhot.bus.bus import Bus, Sample
from rhot.errors import UNDECODABLE
from rhot.messages.simulator import SimFrame
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.controls import Controls
from services.pi_tracker.sources.notes import Notes

# The frame in work and the next.
_QUEUE = 2


class SimulatorSource:
    """The simulated camera of that name."""

    live = True

    def __init__(self, bus: Bus, camera: str) -> None:
        self.notes = Notes(camera)
        self.controls: Controls | None = None
        self.dropped = 0
        self.rejected = 0
        self._bus = bus
        self._camera = camera
        self._skew_ns = 0
        self._decoder = msgspec.json.Decoder(SimFrame)

    def now_ns(self) -> int:
        """What the simulated camera computer's clock reads."""
        return clock.now_ns() + self._skew_ns

    async def frames(self) -> AsyncGenerator[Frame, None]:
        async for sample in self._bus.raw(topics.SIM_FRAME, _QUEUE, camera=self._camera):
            frame = self._frame(sample)
            if frame is None:
                self.rejected += 1
            else:
                yield frame

    def _frame(self, sample: Sample) -> Frame | None:
        try:
            header = self._decoder.decode(sample.attachment)
        except UNDECODABLE:
            return None
        width, height = header.size_px
        valid = (
            header.camera == self._camera
            and min(width, height) >= 2
            and width % 2 == 0
            and height % 2 == 0
            and header.row_time_ns <= 1e8
        )
        if not valid or len(sample.payload) != width * height * 3 // 2:
            return None
        self._skew_ns = header.clock_skew_ns
        image = np.frombuffer(sample.payload, np.uint8).reshape(height * 3 // 2, width)
        return Frame(
            self._camera,
            header.seq,
            header.stamp_ns,
            header.row_time_ns,
            header.size_px,
            image,
            "i420",
            header.full_range,
        )
