"""Where `rhot calibrate camera` and `colors` get their pictures: a recording's frames by number, or
the running camera's.

A camera that does not answer is a BusError, a recording without those frames a CaptureError; both
say what there is.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, CaptureError
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.reader import Reader
from services.pi_tracker.sources.video import VideoReader

# A lossless picture of a 5 Mpx sensor takes a Pi 3 a second to encode.
_ANSWER_S = 5.0
# Between two pictures, so that noise, and a hand that nobody holds quite still, differ.
_PAUSE_S = 0.2


def recorded(camera: str, path: Path, numbers: Sequence[int]) -> list[Frame]:
    """Frames of a video, a folder of images or a capture, by their numbers from 0, in the order of
    numbers.
    """
    wanted, found, count = set(numbers), dict[int, Frame](), 0
    reader = _reader(camera, path)
    reader.open()
    try:
        while len(found) < len(wanted) and (frame := reader.read()) is not None:
            if count in wanted:
                found[count] = frame
            count += 1
    finally:
        reader.close()
    missing = sorted(wanted - set(found))
    if missing:
        raise CaptureError(f"{path}: has {count} frames, numbered from 0; there is no {missing[0]}")
    return [found[number] for number in numbers]


def _reader(camera: str, path: Path) -> Reader:
    if not path.is_dir():
        return VideoReader(camera, path, 30.0)
    if any(path.glob("*.mkv")):
        return CaptureReader(camera, path)
    return FolderReader(camera, path, 30.0)


def spread(camera: str, path: Path, count: int) -> list[int]:
    """Numbers of `count` frames spread over a recording."""
    reader, total = _reader(camera, path), 0
    reader.open()
    try:
        while reader.read() is not None:
            total += 1
    finally:
        reader.close()
    return sorted({round((k + 0.5) * total / count - 0.5) for k in range(count)})


async def live(bus: Bus, camera: str, count: int) -> list[Frame]:
    """The next `count` pictures of a running camera."""
    frames: list[Frame] = []
    while len(frames) < count:
        answers = await bus.get(topics.FRAME, timeout_s=_ANSWER_S, camera=camera)
        if not answers:
            raise BusError(
                f"camera {camera!r} sends no picture; is its tracker running? `rhot top` shows it"
            )
        frames.append(_decoded(answers[0], camera, len(frames)))
        await asyncio.sleep(_PAUSE_S if len(frames) < count else 0.0)
    return frames


def _decoded(picture: bytes, camera: str, number: int) -> Frame:
    image = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise BusError(f"camera {camera!r} answered {len(picture)} bytes that are no picture")
    return Frame(camera, number, 0, 0.0, (image.shape[1], image.shape[0]), image, "bgr")
