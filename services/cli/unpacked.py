"""A recording of `rhot record` as the folders that commands read: a capture and a result.

So `rhot plot` and `rhot score` need to know folders only. What is unpacked is gone when the command
ends; errors name the recording.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from rhot import topics
from rhot.files.capture import Capture
from rhot.messages import HandPoints, HandPose, MarkerFrame
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.messages.simulator import Truth
from services.cli.offline.results import ResultWriter
from services.cli.offline.track_summary import CameraCounter, Summary
from services.cli.recorded.messages import arrivals
from services.cli.recorded.unpacked_capture import is_recording, unpack_rig, unpacking

# Streams of a result, and what they hold.
_RESULT: dict[topics.Topic[Any], tuple[str, type[Any]]] = {
    topics.MARKERS: ("markers", MarkerFrame),
    topics.POINTS: ("points", HandPoints),
    topics.POSE: ("poses", HandPose),
    topics.OBJECT: ("objects", ObjectPose),
    topics.CONTACTS: ("contacts", ObjectContacts),
}


@contextlib.contextmanager
def unpacked(path: Path) -> Iterator[tuple[Capture, Path]]:
    """The capture and the result in a recording; a folder is both as it is.

    Raises CaptureError if the recording cannot be read.
    """
    if not is_recording(path):
        yield Capture(path), path
        return
    with unpacking(path) as folder:
        capture, result = Capture(folder / "capture"), folder / "result"
        _unpack(path, capture, result)
        yield capture, result


def _unpack(path: Path, capture: Capture, result: Path) -> None:
    kinds = {topic: kind for topic, (_, kind) in _RESULT.items()}
    counters: dict[str, CameraCounter] = {}
    rig = unpack_rig(path, capture)
    with ResultWriter(result) as writer, capture.truth.open("wb") as truth:
        for topic, message in arrivals(path, {**kinds, topics.TRUTH: Truth}):
            if topic is topics.TRUTH:
                truth.write(msgspec.json.encode(message) + b"\n")
                continue
            writer.write(_RESULT[topic][0], [message])
            if isinstance(message, MarkerFrame):
                counters.setdefault(message.camera, CameraCounter()).add(message)
        writer.finish(
            Summary(
                rig=rig,
                cameras={name: counter.summary() for name, counter in sorted(counters.items())},
                **writer.counts,
                refusals={},
                complete=True,
                warnings=[],
                notes=[],
                clocks=msgspec.UNSET,
                origin=None,
            )
        )
    if capture.truth.stat().st_size == 0:
        capture.truth.unlink()
