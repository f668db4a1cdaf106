"""Writes one recording: an MCAP file of raw payloads, with schemas, the rig's configuration and
calibration.

Payloads are kept as they came, even if they do not decode. Chunks are short, so that a recorder
that is killed loses half a second; `flush` hands what has come to the system. A full disk raises
DiskFullError, an unwritable folder CaptureError. The file is locked while it is open, so that
recovery leaves it alone.
"""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from mcap.exceptions import UnsupportedCompressionError
from mcap.writer import CompressionType, Writer

from rhot.errors import CaptureError, DiskFullError, disk_full
from rhot.messages.json_schema import json_schema
from rhot.topics import Topic
from services.recorder.chunk_spool import ChunkSpool
from services.recorder.foxglove.scene import Drawn, scene_of, schema
from services.recorder.schemas import SCHEMA_ENCODING, schema_name

# The MCAP profile by which readers know a recording of rhot.
PROFILE = "rhot"
# Of a busy rig. A chunk is in the file only once it is complete: see CHUNK_NS.
CHUNK_BYTES = 65_536
# A chunk ends after so long by its messages' times, whatever is in it, or when it is flushed.
CHUNK_NS = 500_000_000
# mcap ends a chunk when it is full; that it can be ended otherwise is not for its users.
_END_CHUNK = "_Writer__finalize_chunk"
# Where it keeps what is known of those that have ended.
_CHUNKS = "_Writer__chunk_indices"
# Channels that are made of others for other programs have this in their metadata, and no reader of
# ours reads them.
COMPANION = "companion-of"
# A rig has some dozen keys; MCAP has room for 65,535. Names come from the network.
MAX_CHANNELS = 4096
# What attachments are.
_MEDIA = {".json": "application/json", ".glb": "model/gltf-binary", ".stl": "model/stl"}
# Room left for the system and for finishing the file: its index is some 100 bytes a chunk, 1 MB for
# 20 hours.
MIN_FREE_BYTES = 50_000_000


class RecordingWriter:
    """An open recording; use it as a context manager, which finishes the file.

    messages, bytes and refused (messages on more keys than MAX_CHANNELS) count what came; keys are
    those that have a channel; chunks are those that have ended.
    """

    def __init__(
        self,
        path: Path,
        rig: str,
        version: str = "",
        attachments: Mapping[str, bytes] | None = None,
    ) -> None:
        self.path = path
        self.messages = 0
        self.bytes = 0
        self.refused = 0
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        # Time of the first message of the chunk that is being filled.
        self._chunk_ns: int | None = None
        self._scene = scene_of(attachments or {})
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            check_space(path.parent)
            self._file = path.open("xb")
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self.chunks = ChunkSpool(path.parent)
        except OSError as error:
            raise _failed(path, error) from None
        self._writer = _writer(self._file)
        setattr(self._writer, _CHUNKS, self.chunks)
        self._begin(rig, version, attachments or {})

    def _begin(self, rig: str, version: str, attachments: Mapping[str, bytes]) -> None:
        try:
            self._writer.start(profile=PROFILE, library=f"rhot {version}".strip())
            self._writer.add_metadata("rhot", {"rig": rig, "version": version})
            for name, data in attachments.items():
                media = _MEDIA.get(Path(name).suffix, "application/octet-stream")
                self._writer.add_attachment(0, 0, name, media, data)
            self._file.flush()
        except OSError as error:
            _close(self._file)
            _close(self.chunks)
            raise _failed(self.path, error) from None

    @property
    def keys(self) -> Collection[str]:
        """The keys of which something was recorded."""
        return self._channels.keys()

    def add(self, topic: Topic, key: str, payload: bytes, log_time_ns: int) -> None:
        """Write one payload as it is; log_time_ns is when it arrived, on this machine's clock."""
        channel = self._channels.get(key)
        if channel is None and len(self._channels) >= MAX_CHANNELS:
            self.refused += 1
            return
        try:
            if channel is None:
                channel = self._channel(topic, key)
            if self._chunk_ns is not None and log_time_ns - self._chunk_ns >= CHUNK_NS:
                self._end_chunk()
            if self._chunk_ns is None:
                self._chunk_ns = log_time_ns
            self._writer.add_message(
                channel, log_time_ns, payload, log_time_ns, self.messages & 0xFFFFFFFF
            )
            if self._scene is not None:
                for drawn in self._scene.of(topic, payload):
                    self._draw(drawn, log_time_ns)
        except OSError as error:
            raise _failed(self.path, error) from None
        self.messages += 1
        self.bytes += len(payload)

    def _draw(self, drawn: Drawn, log_time_ns: int) -> None:
        """What Foxglove and Rerun draw of a message, beside it."""
        channel = self._channels.get(drawn.channel)
        if channel is None:
            if drawn.schema not in self._schemas:
                self._schemas[drawn.schema] = self._writer.register_schema(
                    drawn.schema, "protobuf", schema(drawn.schema)
                )
            self._channels[drawn.channel] = channel = self._writer.register_channel(
                drawn.channel, "protobuf", self._schemas[drawn.schema], {COMPANION: "rhot"}
            )
        self._writer.add_message(channel, log_time_ns, drawn.data, log_time_ns)

    def _channel(self, topic: Topic, key: str) -> int:
        name = schema_name(topic)
        if topic.message is not None and name not in self._schemas:
            data = json_schema(topic.message)
            self._schemas[name] = self._writer.register_schema(name, SCHEMA_ENCODING, data)
        encoding = "json" if name else topic.media_type
        self._channels[key] = self._writer.register_channel(
            key, encoding, self._schemas.get(name, 0), {"encoding": topic.encoding}
        )
        return self._channels[key]

    def flush(self) -> None:
        """Hand all messages to the system: from then on a kill does not lose them.

        Raises DiskFullError when the disk is nearly full (the file can still be finished).
        """
        try:
            self._end_chunk()
            check_space(self.path.parent)
        except OSError as error:
            raise _failed(self.path, error) from None

    def _end_chunk(self) -> None:
        getattr(self._writer, _END_CHUNK)()
        self._chunk_ns = None
        self._file.flush()

    def close(self) -> None:
        """Write the index and close; a second call does nothing."""
        if self._file.closed:
            return
        try:
            self._writer.finish()
            self._file.flush()
        except OSError as error:
            raise _failed(self.path, error) from None
        finally:
            _close(self._file)
            _close(self.chunks)

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def check_space(folder: Path, least_bytes: int = MIN_FREE_BYTES) -> None:
    """Raises DiskFullError while less is free in a folder."""
    free = shutil.disk_usage(folder).free
    if free < least_bytes:
        raise DiskFullError(
            f"{folder}: only {free / 1e6:.0f} MB free, recordings need {least_bytes / 1e6:.0f}"
        )


def _writer(file: object) -> Writer:
    """Compresses with zstd, or lz4 where zstandard is not installed, or not at all."""
    for compression in (CompressionType.ZSTD, CompressionType.LZ4):
        try:
            return Writer(file, CHUNK_BYTES, compression)  # type: ignore[arg-type]
        except UnsupportedCompressionError:
            continue
    return Writer(file, CHUNK_BYTES, CompressionType.NONE)  # type: ignore[arg-type]


def _close(file: object) -> None:
    try:
        file.close()  # type: ignore[attr-defined]
    except OSError:
        # A full disk refuses the last bytes once more; the first refusal is the one reported.
        return


def _failed(path: Path, error: OSError) -> CaptureError:
    return disk_full(error, path) or CaptureError(
        f"{path}: cannot be recorded: {error.strerror or error};"
        " free the disk, or set [recorder] folder to one that can be written"
    )
