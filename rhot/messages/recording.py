"""What the recorder is asked for and answers: recordings, and one of them being replayed.

As in rhot/messages/__init__.py: JSON, units in the names, fields added but never renamed. What is
replayed comes under a name of its own (replay_rig), so that it never mixes with what is
live.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from rhot.messages import Count, Message, Name, NonNegative, Stamp

# A file in the recorder's folder: never a path.
FileName = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,180}\.mcap$")]
# Faster, a browser shows no motion and a busy router drops; slower, nobody waits for the end.
Rate = Annotated[float, msgspec.Meta(ge=0.05, le=16.0)]
Seconds = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]


def replay_rig(rig: str) -> str:
    """The rig's name under which its recorder replays: live and replayed never share a key."""
    # A name has 64 letters at most.
    return f"{rig[:57]}-replay"


class Recording(Message, frozen=True, kw_only=True):
    """One file.

    Of one that is not whole (cut off, damaged, or still being written) only name and size are
    known.
    """

    name: FileName
    state: Literal["whole", "recording", "damaged"]
    size_mb: NonNegative
    rig: str = ""
    start_ns: Stamp = 0
    duration_s: NonNegative = 0.0
    messages: Count = 0


class Recordings(Message, frozen=True, kw_only=True):
    """The newest recordings, newest first; more counts those that are left out."""

    folder: str
    recordings: Annotated[list[Recording], msgspec.Meta(max_length=200)]
    more: Count = 0


class Replay(Message, frozen=True, kw_only=True):
    """A recording that is open: rig is the name in the keys that it is published on."""

    name: str
    rig: Name
    recorded_rig: str
    state: Literal["playing", "paused", "ended"]
    at_s: float
    duration_s: NonNegative
    rate: float
    loop: bool


class RecorderState(Message, frozen=True, kw_only=True):
    """What the recorder does: file is what it writes, "" while it records nothing.

    records is false of one that only replays. note says what went wrong with the newest replay.
    """

    records: bool = True
    file: str = ""
    since_ns: Stamp = 0
    messages: Count = 0
    size_mb: NonNegative = 0.0
    replay: Replay | None = None
    note: str = ""


class RecorderRequest(Message, frozen=True, kw_only=True):
    """What the recorder is asked to do.

    "record" and "stop" are about recording. "open" begins to replay the recording called name;
    "play", "pause" and "close" are about that one, as is "set", which changes what is given: at_s
    (seconds of the recording, negative from its end), rate, loop.
    """

    do: Literal["record", "stop", "open", "play", "pause", "set", "close"]
    name: FileName | None = None
    at_s: Seconds | None = None
    rate: Rate | None = None
    loop: bool | None = None
