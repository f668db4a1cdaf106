"""Recordings to read, cut and break."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rhot import topics
from services.recorder.writer import RecordingWriter

START_NS = 1_700_000_000_000_000_000


@pytest.fixture
def start_ns() -> int:
    """When the first message arrives."""
    return START_NS


@pytest.fixture
def payload() -> Callable[[int], bytes]:
    """Something like a MarkerFrame, which does not compress to nothing."""
    return lambda seq: (
        f'{{"camera": "left", "seq": {seq}, "noise": "{pow(seq + 2, 97, 10**200 + 357)}"}}'.encode()
    )


@pytest.fixture
def write(payload: Callable[[int], bytes]) -> Callable[..., Path]:
    """Write a recording of `count` messages, 10 ms apart, alternately of two cameras."""

    def make(path: Path, count: int = 1000, rig: str = "desk") -> Path:
        with RecordingWriter(path, rig, "1.2.3", {"config.json": b'{"rig": 1}'}) as writer:
            for seq in range(count):
                writer.add(
                    topics.MARKERS,
                    f"rhot/{rig}/camera/{('left', 'right')[seq % 2]}/markers",
                    payload(seq),
                    START_NS + seq * 10_000_000,
                )
        return path

    return make
