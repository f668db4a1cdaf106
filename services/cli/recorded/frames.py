"""Frames of a recording by number: of a video, a folder of pictures or a capture.

A recording without those frames is a CaptureError that says how many it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.reader import Reader
from services.pi_tracker.sources.video import VideoReader

# For stamps where a recording has none; colours do not depend on it.
_FPS = 30.0


def frames_by_number(camera: str, path: Path, numbers: Sequence[int]) -> list[Frame]:
    """The frames with these numbers, counted from 0, in that order.

    Raises CaptureError if the recording has fewer.
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


def frame_names(camera: str, path: Path, numbers: Sequence[int]) -> list[str]:
    """What to call these frames, which there are: the files of a folder, else by their numbers."""
    reader = _reader(camera, path)
    if not isinstance(reader, FolderReader):
        return [f"frame {number}" for number in numbers]
    reader.open()
    names = [reader.name_of(number) for number in numbers]
    reader.close()
    return names


def _reader(camera: str, path: Path) -> Reader:
    if not path.is_dir():
        return VideoReader(camera, path, _FPS)
    if any(path.glob("*.mkv")):
        return CaptureReader(camera, path)
    return FolderReader(camera, path, _FPS)


def spread_numbers(camera: str, path: Path, count: int) -> list[int]:
    """Numbers of `count` frames spread over a recording."""
    reader, total = _reader(camera, path), 0
    reader.open()
    try:
        while reader.read() is not None:
            total += 1
    finally:
        reader.close()
    return sorted({round((k + 0.5) * total / count - 0.5) for k in range(count)})
