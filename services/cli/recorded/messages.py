"""Reads the messages of one topic from a recording.

A recording is a result folder of `rhot track`, one of its .jsonl files, or an MCAP file of `rhot
record`. A file that cannot be read, or a damaged message, raises CaptureError with the file's name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE, CaptureError
from rhot.files.capture import read_lines

M = TypeVar("M", bound=msgspec.Struct)


def messages(recording: Path, topic: topics.Topic[M], kind: type[M], stream: str) -> Iterator[M]:
    """All messages of a topic, in order.

    stream is the name of the .jsonl file that holds them in a result folder.
    """
    path = recording / f"{stream}.jsonl" if recording.is_dir() else recording
    if path.suffix != ".mcap":
        yield from read_lines(path, kind)
        return
    for _, message in arrivals(path, {topic: kind}):
        yield message


def arrivals(
    path: Path, kinds: Mapping[topics.Topic[Any], type[Any]]
) -> Iterator[tuple[topics.Topic[Any], Any]]:
    """All messages of several topics in an MCAP file, in the order of arrival."""
    # Only for MCAP files: the package mcap is not needed for the others.
    from services.recorder.reader import read

    decoders = {topic: msgspec.json.Decoder(kind) for topic, kind in kinds.items()}
    for record in read(path):
        topic = topics.find(record.key)
        if topic is None or topic not in decoders:
            continue
        try:
            yield topic, decoders[topic].decode(record.payload)
        except UNDECODABLE as error:
            raise CaptureError(f"{path}: a message on {record.key} is damaged: {error}") from None
