"""Pictures that were asked for, kept for a while: a fit request names them by their hash.

A picture that was not used for long, or was pushed out by many others, is gone; pointing at it is a
CalibrationError that says so.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict

from rhot.bus.bus import Bus
from rhot.errors import CalibrationError
from rhot.messages.camera import picture_name
from services.pi_tracker.endpoints.preview import Preview, png
from services.pi_tracker.image.frame import Frame

# The page asks four times a second: pictures somebody may still click on, and those that were
# clicked on. 0.5 MB each at 640x480.
_RECENT, _USED = 16, 24
# Large sensors get fewer of each, as a Pi 3 has 1 GB.
_MOST_BYTES = 24_000_000


class PictureCache(Preview):
    """Previews and single frames of a camera; the single ones are kept by name."""

    def __init__(self, bus: Bus, camera: str, tasks: asyncio.TaskGroup) -> None:
        super().__init__(bus, camera, tasks)
        self._recent: OrderedDict[str, Frame] = OrderedDict()
        self._used: OrderedDict[str, Frame] = OrderedDict()

    def has(self, name: str) -> bool:
        """Whether a picture is kept."""
        return name in self._used or name in self._recent

    def frame(self, name: str) -> Frame:
        """The frame of a picture, which is kept longer from now on.

        CalibrationError if it is gone.
        """
        frame = self._used.get(name) or self._recent.get(name)
        if frame is None:
            raise CalibrationError(f"picture {name} is not kept any more: point at a newer one")
        _keep(self._used, name, frame, _USED)
        return frame

    async def _encoded(self) -> bytes | None:
        frame = self._last
        if frame is None:
            return None
        picture = await asyncio.to_thread(png, frame)
        _keep(self._recent, picture_name(picture), frame, _RECENT)
        return picture


def _keep(kept: OrderedDict[str, Frame], name: str, frame: Frame, most: int) -> None:
    kept[name] = frame
    kept.move_to_end(name)
    while len(kept) > most or (len(kept) > 1 and len(kept) * frame.image.nbytes > _MOST_BYTES):
        kept.popitem(last=False)
