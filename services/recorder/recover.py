"""Restores truncated or damaged recordings: every chunk that can still be read goes to
*.recovered.mcap.

A killed recorder leaves a file without its index and with half a chunk at its end; damage in the
middle costs the chunks it hits. The broken file is left as it is. A file that another process is
recording into is left alone; one without any readable message gives no file.
"""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk

from rhot import topics
from rhot.errors import CaptureError
from services.recorder.chunks import RECORD_LIMIT
from services.recorder.reader import is_finished
from services.recorder.writer import PROFILE, RecordingWriter

_SUFFIX = ".recovered.mcap"


@dataclass(frozen=True)
class Recovered:
    """The result of one recovery; damaged_chunks counts those that were skipped."""

    source: Path
    target: Path
    messages: int
    damaged_chunks: int


def truncated_recordings(folder: Path) -> list[Path]:
    """Recordings in a folder that were cut off and not yet recovered, oldest name first."""
    return [
        path
        for path in sorted(folder.glob("*.mcap"))
        if not path.name.endswith(_SUFFIX)
        and not target_of(path).exists()
        and not is_in_use(path)
        and not is_finished(path)
    ]


def target_of(path: Path) -> Path:
    """Where the recovered file goes."""
    return path.with_name(path.name.removesuffix(".mcap") + _SUFFIX)


def recover(path: Path) -> Recovered:
    """Write what can be read of `path` to *.recovered.mcap beside it.

    Raises CaptureError if the file cannot be read, is no recording of rhot, is being recorded into,
    or has no readable message.
    """
    target = target_of(path)
    try:
        if is_in_use(path):
            raise CaptureError(f"{path}: is being recorded into; stop that recorder first")
        target.unlink(missing_ok=True)
        with path.open("rb") as file:
            return _copy(path, target, _ReadableRecords(file))
    except OSError as error:
        raise CaptureError(f"{path}: cannot be recovered: {error.strerror or error}") from None


def _copy(path: Path, target: Path, records: _ReadableRecords) -> Recovered:
    header, head = records.header, records.head()
    if header is None or header.profile != PROFILE:
        raise CaptureError(f"{path}: is no recording of rhot, or not even its beginning is whole")
    rig = next((m.metadata.get("rig", "") for m in head if isinstance(m, Metadata)), "")
    attachments = {a.name: a.data for a in head if isinstance(a, Attachment)}
    # Written under a hidden name: a recovery that is itself killed must not look finished.
    partial = target.with_name(f".{target.name}.part")
    partial.unlink(missing_ok=True)
    with RecordingWriter(partial, rig, header.library.removeprefix("rhot "), attachments) as writer:
        for key, message in records.messages():
            topic = topics.find(key)
            if topic is not None:
                writer.add(topic, key, message.data, message.log_time)
    if writer.messages == 0:
        partial.unlink()
        raise CaptureError(f"{path}: holds no whole message; nothing to recover")
    partial.rename(target)
    return Recovered(path, target, writer.messages, records.damaged_chunks)


class _ReadableRecords:
    """The records of a damaged file that can still be read; header is None if not even that can."""

    def __init__(self, file: IO[bytes]) -> None:
        self.damaged_chunks = 0
        self._channels: dict[int, str] = {}
        self._records = _until_damaged(file)
        self._first_chunk: Chunk | None = None
        first = next(self._records, None)
        self.header = first if isinstance(first, Header) else None

    def head(self) -> list[Metadata | Attachment]:
        """Metadata and attachments before the first chunk."""
        head: list[Metadata | Attachment] = []
        for record in self._records:
            if isinstance(record, Chunk):
                self._first_chunk = record
                break
            if isinstance(record, Metadata | Attachment):
                head.append(record)
        return head

    def messages(self) -> Iterator[tuple[str, Message]]:
        """(key, message) of every whole chunk."""
        if self._first_chunk is not None:
            yield from self._of_chunk(self._first_chunk)
        for record in self._records:
            if isinstance(record, Chunk):
                yield from self._of_chunk(record)

    def _of_chunk(self, chunk: Chunk) -> Iterator[tuple[str, Message]]:
        try:
            if chunk.uncompressed_size > RECORD_LIMIT:
                raise ValueError("absurd size")
            records = breakup_chunk(chunk, validate_crc=True)
        except Exception:  # decoders of damaged bytes may raise anything
            self.damaged_chunks += 1
            return
        for record in records:
            if isinstance(record, Channel):
                self._channels[record.id] = record.topic
            elif isinstance(record, Message) and record.channel_id in self._channels:
                yield self._channels[record.channel_id], record


def _until_damaged(file: IO[bytes]) -> Iterator[McapRecord]:
    try:
        yield from StreamReader(file, emit_chunks=True, record_size_limit=RECORD_LIMIT).records
    except OSError:
        raise
    except Exception:  # the end of what can be read; decoders may raise anything
        return


def is_in_use(path: Path) -> bool:
    """Whether a recorder holds its lock on the file."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
