"""Decides what is recorded when: one file for each session, named after its start. Pure but for the
files it writes.

With [recorder] autostart everything is recorded from the beginning, and a session that starts opens
a file of its own. Without, only sessions are recorded: messages between them are not kept. Late or
undecodable payloads are kept as they came; a session message that does not decode starts and stops
nothing. Sessions that follow each other faster than people start them share a file; a long one has
several (part_minutes, part_mb). A full disk raises DiskFullError: `suspend` then closes the file,
and `resume` opens another once there is space.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

import msgspec
import numpy as np

from rhot import topics
from rhot.errors import UNDECODABLE, CaptureError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Viewer
from rhot.messages import Session
from rhot.topics import Topic
from services.recorder.rig_keys import RigKeys
from services.recorder.writer import MIN_FREE_BYTES, RecordingWriter, check_space

# A calibration file is some kB; a file larger than this is none.
_MAX_ATTACHMENT_BYTES = 1_000_000
# A scanned cup of 50 000 triangles has 2.5 MB; readers take no record beyond 16 MB.
_MAX_MESH_BYTES = 8_000_000
# So often a session may start or stop in so long: people need seconds for each, and a program gone
# mad must not open hundreds of files.
_CHANGES, _WITHIN_NS = 8, 60_000_000_000
# What must be free before recording goes on: enough that it does not stop again at once.
_RESUME_BYTES = 2 * MIN_FREE_BYTES


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
    return _free_path(folder, f"rhot-{rig}-{day}-{clock}")


def _free_path(folder: Path, stem: str) -> Path:
    path, number = folder / f"{stem}.mcap", 1
    while path.exists():
        number += 1
        path = folder / f"{stem}-{number}.mcap"
    return path


def attachments(config: RigConfig) -> dict[str, bytes]:
    """The rig's configuration as JSON, its calibration files and the meshes of objects, by name.

    A recording cannot be understood later without them.
    """
    # Recordings are passed on: the page's token is nobody else's.
    shared = msgspec.structs.replace(config, viewer=Viewer())
    files = {"config.json": msgspec.json.encode(shared)}
    for path in sorted(config.calibration_dir.glob("*.json")):
        try:
            if path.stat().st_size <= _MAX_ATTACHMENT_BYTES:
                files[f"calibration/{path.name}"] = path.read_bytes()
        except OSError:
            # A calibration that cannot be read is missing in the rig, too.
            continue
    return files | _meshes(config)


def _meshes(config: RigConfig) -> dict[str, bytes]:
    """The mesh files of objects, by the object's name: whoever plays the recording has none."""
    files = {}
    for table in config.object:
        path = Path(config.folder) / table.mesh
        try:
            if table.mesh and path.stat().st_size <= _MAX_MESH_BYTES:
                files[f"meshes/{table.name}{path.suffix.lower()}"] = path.read_bytes()
        except OSError:
            continue
    return files


class Recorder:
    """Takes every sample and keeps those that belong to a session.

    messages, bytes, refused (messages of too many strangers), lost (while suspended) and postponed
    (sessions that came too fast) count over all files; path is the file being written, None between
    sessions. Without follow_sessions only start() and stop() open and close files.
    """

    def __init__(
        self, config: RigConfig, folder: Path, version: str = "", *, follow_sessions: bool = True
    ) -> None:
        self._config = config
        self.follows_sessions = follow_sessions
        self._folder = folder
        self._version = version
        self._writer: RecordingWriter | None = None
        # When the part that is being written began, and what `bytes` was then.
        self._part_ns = 0
        self._part_bytes = 0
        self._named: Path | None = None
        # Whether there is something to record, also while the disk is full.
        self._wanted = False
        self._keys = RigKeys(config)
        # The session that is recorded, and the one that was announced last.
        self._session_ns: int | None = None
        self._announced_ns: int | None = None
        # When the latest sessions started or stopped.
        self._changed_ns: list[int] = []
        self._decoder = msgspec.json.Decoder(Session)
        self.suspended = False
        self.messages = 0
        self.bytes = 0
        self.refused = 0
        self.lost = 0
        self.postponed = 0

    @property
    def path(self) -> Path | None:
        """The file being written."""
        return self._writer.path if self._writer else None

    @property
    def folder(self) -> Path:
        """Where recordings go."""
        return self._folder

    def start(self, start_ns: int, path: Path | None = None) -> Path:
        """Open a file for what starts at start_ns (closing the one before); raises CaptureError."""
        self._close()
        self._wanted, self._named = True, path
        path = path or recording_path(self._folder, self._config.rig.name, start_ns)
        # The first look at the clock says when it began: a session's start may be long ago.
        self._part_ns, self._part_bytes = 0, self.bytes
        self._writer = RecordingWriter(
            path, self._config.rig.name, self._version, attachments(self._config)
        )
        return path

    def stop(self) -> None:
        """Finish the file, if one is open; raises DiskFullError if the disk is full."""
        self._wanted = False
        self._close()

    def _close(self) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def suspend(self) -> None:
        """The disk is full: finish the file as far as that goes, and keep nothing until resume.

        A file that cannot even be finished is restored at the recorder's next start.
        """
        self.suspended = True
        with contextlib.suppress(CaptureError):
            self._close()

    def resume(self, now_ns: int) -> None:
        """Go on, in a new file, if there is something to record; raises DiskFullError if the disk
        is still full.
        """
        check_space(self._folder, _RESUME_BYTES)
        self.suspended = False
        if self._wanted:
            self.start(now_ns)

    def follow(self, session: Session, now_ns: int) -> None:
        """Open and close files as sessions start and stop.

        The same session announced again changes nothing.
        """
        announced_ns = session.start_ns if session.running else None
        if announced_ns != self._announced_ns:
            self._announced_ns = announced_ns
            self._change_session(now_ns)
            self.postponed += int(self._session_ns != announced_ns)

    def _change_session(self, now_ns: int) -> None:
        """Begin or end what was announced, unless the last few times were just now."""
        if self._announced_ns == self._session_ns:
            return
        # A clock that was set back tells nothing about the time before.
        self._changed_ns = [t for t in self._changed_ns if 0 <= now_ns - t < _WITHIN_NS]
        if len(self._changed_ns) >= _CHANGES:
            return
        self._changed_ns.append(now_ns)
        self._session_ns = self._announced_ns
        if self.suspended:
            self._wanted = self._session_ns is not None or self._config.recorder.autostart
        elif self._session_ns is not None:
            self.start(self._session_ns)
        elif not self._config.recorder.autostart:
            self.stop()

    def add(self, topic: Topic, key: str, payload: bytes, log_time_ns: int) -> None:
        """Take one sample; it is kept if a file is open. Raises CaptureError."""
        follows = self.follows_sessions and topic is topics.SESSION
        session = self._session(payload) if follows else None
        if session is not None and session.running:
            self.follow(session, log_time_ns)
        if self._writer is not None:
            self._keep(self._writer, topic, key, payload, log_time_ns)
        else:
            self.lost += int(self.suspended)
        # The stop is the last message of its own recording.
        if session is not None and not session.running:
            self.follow(session, log_time_ns)

    def _keep(
        self, writer: RecordingWriter, topic: Topic, key: str, payload: bytes, log_time_ns: int
    ) -> None:
        refused = writer.refused
        if key in writer.keys or self._keys.admits(topic, key):
            writer.add(topic, key, payload, log_time_ns)
        else:
            self.refused += 1
            return
        if writer.refused > refused:
            self.refused += 1
            return
        self.messages += 1
        self.bytes += len(payload)

    def flush(self, now_ns: int) -> None:
        """Hand whole chunks to the system, begin another part where this one is long enough, and
        begin or end a session that had to wait.

        Raises DiskFullError when the disk is nearly full.
        """
        if self._writer is not None:
            self._writer.flush()
            if self._part_is_full(now_ns):
                self._begin_part(now_ns)
        self._change_session(now_ns)

    def _part_is_full(self, now_ns: int) -> bool:
        # A clock that was set back says nothing of how long this part is.
        self._part_ns = min(self._part_ns or now_ns, now_ns)
        limits = self._config.recorder
        return (
            now_ns - self._part_ns >= limits.part_minutes * 60e9
            or self.bytes - self._part_bytes >= limits.part_mb * 1e6
        )

    def _begin_part(self, now_ns: int) -> None:
        # Parts of a file that somebody named are called after it.
        named = self._named
        self.start(now_ns, None if named is None else _free_path(named.parent, named.stem))
        self._named, self._part_ns = named, now_ns

    def _session(self, payload: bytes) -> Session | None:
        try:
            return self._decoder.decode(payload)
        except UNDECODABLE:
            return None
