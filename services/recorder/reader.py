"""Reads recordings (MCAP): what arrived, when, on which key.

Files that are not recordings of rhot, or are truncated, raise CaptureError; recover.py restores
truncated ones. Payloads are given as they were recorded: they may not decode.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, NamedTuple

from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, ChunkIndex, Statistics
from mcap.summary import Summary as Index

from rhot.errors import CaptureError
from services.recorder.chunks import RECORD_LIMIT, in_order
from services.recorder.writer import COMPANION, PROFILE

MAGIC = b"\x89MCAP0\r\n"


class Record(NamedTuple):
    """One recorded payload; log_time_ns is its arrival on the recorder's clock."""

    log_time_ns: int
    key: str
    encoding: str
    payload: bytes


@dataclass(frozen=True)
class Summary:
    """Rig, time and numbers of messages of a recording."""

    rig: str
    messages: int
    start_ns: int
    end_ns: int
    # key -> messages
    keys: dict[str, int]

    @property
    def duration_s(self) -> float:
        """From the first message to the last."""
        return (self.end_ns - self.start_ns) * 1e-9


def is_finished(path: Path) -> bool:
    """Whether a file ends as a complete MCAP file does. Raises OSError if it cannot be read."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - len(MAGIC)))
        return size > 2 * len(MAGIC) and file.read() == MAGIC


def read(path: Path, start_ns: int = 0, end_ns: int | None = None) -> Iterator[Record]:
    """Every message of a recording in the order of arrival, those of start_ns to end_ns alone.

    Both ends count. What lies before is not read: the file's index says where to begin. Raises
    CaptureError for files that are missing, damaged, cut off or not of rhot.
    """
    with _open(path) as file:
        reader = _reader(path, file)
        try:
            channels, chunks = _index(path, reader)
            for message in in_order(file, chunks, start_ns, end_ns):
                channel = channels.get(message.channel)
                if channel is not None:
                    yield Record(message.log_time_ns, *channel, message.payload)
        except CaptureError:
            raise
        except Exception as error:  # decoders of damaged bytes may raise anything
            raise _damaged(path, error) from None


def _index(
    path: Path, reader: SeekingReader
) -> tuple[dict[int, tuple[str, str]], list[ChunkIndex]]:
    """Key and encoding of each channel, and where the chunks are."""
    index, _ = _summary_of(path, reader)
    channels = {
        channel.id: (channel.topic, channel.metadata.get("encoding", channel.message_encoding))
        for channel in _own_channels(index)
    }
    return channels, index.chunk_indexes


def _summary_of(path: Path, reader: SeekingReader) -> tuple[Index, Statistics]:
    index = reader.get_summary()
    if index is None or index.statistics is None:
        raise CaptureError(f"{path}: has no summary; it was not written by rhot's recorder")
    return index, index.statistics


def _own_channels(index: Index) -> list[Channel]:
    """Those that hold what was on the bus; beside them the recorder writes pictures of it."""
    return [c for c in index.channels.values() if COMPANION not in c.metadata]


def summarize(path: Path) -> Summary:
    """Counts and times of a recording, without reading its messages; errors as `read`."""
    with _open(path) as file:
        reader = _reader(path, file)
        try:
            return _summary(path, reader)
        except CaptureError:
            raise
        except Exception as error:  # likewise
            raise _damaged(path, error) from None


def _summary(path: Path, reader: SeekingReader) -> Summary:
    index, statistics = _summary_of(path, reader)
    rigs = [m.metadata.get("rig", "") for m in reader.iter_metadata() if m.name == "rhot"]
    counts = statistics.channel_message_counts
    keys = {c.topic: counts.get(c.id, 0) for c in _own_channels(index)}
    return Summary(
        rig=rigs[0] if rigs else "",
        messages=sum(keys.values()),
        start_ns=statistics.message_start_time,
        end_ns=statistics.message_end_time,
        keys=keys,
    )


def read_attachments(path: Path) -> dict[str, bytes]:
    """The configuration and calibration kept in a recording, by name; errors as `read`."""
    with _open(path) as file:
        try:
            return {a.name: a.data for a in _reader(path, file).iter_attachments()}
        except CaptureError:
            raise
        except Exception as error:  # likewise
            raise _damaged(path, error) from None


def _open(path: Path) -> IO[bytes]:
    try:
        return path.open("rb")
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read: {error.strerror}") from None


def _reader(path: Path, file: IO[bytes]) -> SeekingReader:
    if file.read(len(MAGIC)) != MAGIC:
        raise CaptureError(f"{path}: is no MCAP file; give a recording (*.mcap) of `rhot record`")
    file.seek(0)
    if not is_finished(path):
        raise CaptureError(
            f"{path}: was cut off before it was finished;"
            f" restore it with `rhot replay --recover {path}`"
        )
    try:
        reader = SeekingReader(file, validate_crcs=True, record_size_limit=RECORD_LIMIT)
        profile = reader.get_header().profile
    except (McapError, ValueError) as error:
        raise _damaged(path, error) from None
    if profile != PROFILE:
        raise CaptureError(
            f"{path}: is an MCAP file, but no recording of rhot (its profile is {profile!r})"
        )
    return reader


def _damaged(path: Path, error: Exception) -> CaptureError:
    return CaptureError(
        f"{path}: is damaged: {type(error).__name__}: {error}"[:300]
        + f"; save what is whole with `rhot replay --recover {path}`"
    )
