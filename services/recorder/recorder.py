"""Decides what is recorded when: one file for each session, named after its start. Pure but for the
files it writes.

With [recorder] autostart everything is recorded from the beginning, and a session that starts opens
a file of its own. Without, only sessions are recorded: messages between them are not kept. Late or
undecodable payloads are kept as they came; a session message that does not decode starts and stops
nothing.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from rhot import topics
from rhot.errors import UNDECODABLE
from rhot.files.config import RigConfig
from rhot.messages import Session
from rhot.topics import Topic
from services.recorder.writer import RecordingWriter

# A calibration file is some kB; a file larger than this is none.
_MAX_ATTACHMENT_BYTES = 1_000_000


def recorded_topics(config: RigConfig) -> list[Topic]:
    """The topics to record: those marked so in the table, the simulator's truth only where
    something is simulated.
    """
    simulated = config.objects.source == "simulator" or any(
        c.source == "simulator" for c in config.camera
    )
    return [
        topic
        for topic in topics.TOPICS
        if topic.recorded and (simulated or topic is not topics.TRUTH)
    ]


def recording_path(folder: Path, rig: str, start_ns: int) -> Path:
    """`rhot-<rig>-YYYYmmdd-HHMMSS.mcap` of a start (UTC), with -2, -3 ... if that name is taken."""
    iso = str(np.datetime64(start_ns // 10**9, "s"))
    day, _, clock = iso.replace("-", "").replace(":", "").partition("T")
    stem = f"rhot-{rig}-{day}-{clock}"
    path, number = folder / f"{stem}.mcap", 1
    while path.exists():
        number += 1
        path = folder / f"{stem}-{number}.mcap"
    return path


def attachments(config: RigConfig) -> dict[str, bytes]:
    """The rig's configuration as JSON and its calibration files, by name.

    A recording cannot be understood later without them.
    """
    files = {"config.json": msgspec.json.encode(config)}
    for path in sorted(config.calibration_dir.glob("*.json")):
        try:
            if path.stat().st_size <= _MAX_ATTACHMENT_BYTES:
                files[f"calibration/{path.name}"] = path.read_bytes()
        except OSError:
            # A calibration that cannot be read is missing in the rig, too.
            continue
    return files


class Recorder:
    """Takes every sample and keeps those that belong to a session.

    messages, bytes and refused (messages on too many keys) count over all files; path is the file
    being written, None between sessions. Without follow_sessions only start() and stop() open and
    close files.
    """

    def __init__(
        self, config: RigConfig, folder: Path, version: str = "", *, follow_sessions: bool = True
    ) -> None:
        self._config = config
        self._follow_sessions = follow_sessions
        self._folder = folder
        self._version = version
        self._writer: RecordingWriter | None = None
        self._session_ns: int | None = None
        self._decoder = msgspec.json.Decoder(Session)
        self.messages = 0
        self.bytes = 0
        self.refused = 0

    @property
    def path(self) -> Path | None:
        """The file being written."""
        return self._writer.path if self._writer else None

    def start(self, start_ns: int, path: Path | None = None) -> Path:
        """Open a file for what starts at start_ns (closing the one before); raises CaptureError."""
        self.stop()
        path = path or recording_path(self._folder, self._config.rig.name, start_ns)
        self._writer = RecordingWriter(
            path, self._config.rig.name, self._version, attachments(self._config)
        )
        return path

    def stop(self) -> None:
        """Finish the file, if one is open; raises CaptureError if the disk is full."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def follow(self, session: Session) -> None:
        """Open and close files as sessions start and stop.

        The same session announced again changes nothing.
        """
        if session.running and session.start_ns != self._session_ns:
            self._session_ns = session.start_ns
            self.start(session.start_ns)
        elif not session.running and self._session_ns is not None:
            self._session_ns = None
            if not self._config.recorder.autostart:
                self.stop()

    def add(self, topic: Topic, key: str, payload: bytes, log_time_ns: int) -> None:
        """Take one sample; it is kept if a file is open. Raises CaptureError."""
        follows = self._follow_sessions and topic is topics.SESSION
        session = self._session(payload) if follows else None
        if session is not None and session.running:
            self.follow(session)
        if self._writer is not None:
            refused = self._writer.refused
            self._writer.add(topic, key, payload, log_time_ns)
            if self._writer.refused > refused:
                self.refused += 1
            else:
                self.messages += 1
                self.bytes += len(payload)
        # The stop is the last message of its own recording.
        if session is not None and not session.running:
            self.follow(session)

    def flush(self) -> None:
        """Hand whole chunks to the system; raises CaptureError when the disk is nearly full."""
        if self._writer is not None:
            self._writer.flush()

    def _session(self, payload: bytes) -> Session | None:
        try:
            return self._decoder.decode(payload)
        except UNDECODABLE:
            return None
