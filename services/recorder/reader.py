"""Reads recordings (MCAP): what arrived, when, on which key.

Files that are not recordings of rhot, or are truncated, raise CaptureError; recover.py restores
truncated ones. Payloads are given as they were recorded: they may not decode.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from mcap.exceptions import McapError
from mcap.reader import SeekingReader

from rhot.errors import CaptureError
from services.recorder.writer import PROFILE

MAGIC = b"\x89MCAP0\r\n"
# Records of rhot are at most 65 KiB and the largest message; a longer one is damage, and no memory
# must be allocated for it.
RECORD_LIMIT = 16 * 1024 * 1024


@dataclass(frozen=True)
class Record:
    """One recorded payload; log_time_ns is its arrival on the recorder's clock."""

    log_time_ns: int
    key: str
    payload: bytes
    encoding: str


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


def read(path: Path) -> Iterator[Record]:
    """Every message of a recording in the order of arrival.

    Raises CaptureError for files that are missing, damaged, cut off or not of rhot.
    """
    with _open(path) as file:
        reader = _reader(path, file)
        try:
            for _, channel, message in reader.iter_messages():
                yield Record(
                    message.log_time,
                    channel.topic,
                    message.data,
                    channel.metadata.get("encoding", channel.message_encoding),
                )
        except CaptureError:
            raise
        except Exception as error:  # decoders of damaged bytes may raise anything
            raise _damaged(path, error) from None


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
    summary = reader.get_summary()
    if summary is None or summary.statistics is None:
        raise CaptureError(f"{path}: has no summary; it was not written by rhot's recorder")
    rigs = [m.metadata.get("rig", "") for m in reader.iter_metadata() if m.name == "rhot"]
    statistics = summary.statistics
    counts = statistics.channel_message_counts
    return Summary(
        rig=rigs[0] if rigs else "",
        messages=statistics.message_count,
        start_ns=statistics.message_start_time,
        end_ns=statistics.message_end_time,
        keys={c.topic: counts.get(c.id, 0) for c in summary.channels.values()},
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
