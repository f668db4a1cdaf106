"""The recordings of a folder: which there are, and which file a name means.

Names come from the network: nothing outside the folder is ever opened. Files that cannot be read
are listed as what they are. Blocks while it reads; an entry is read once, until its file changes.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot.errors import CaptureError
from rhot.messages.recording import FileName, Recording, Recordings
from services.recorder.reader import summarize
from services.recorder.recover import is_in_use

# 200 entries of some 250 bytes fit an answer.
_MOST = 200


class Library:
    """A folder of recordings; it need not exist."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        # Name -> what the file was like when it was read, and its entry.
        self._known: dict[str, tuple[tuple[int, int], Recording]] = {}

    def list(self) -> Recordings:
        """All recordings, newest first."""
        found = []
        for path in self.folder.glob("*.mcap"):
            try:
                # Names that could not be asked for are no recordings of ours.
                name = msgspec.convert(path.name, FileName)
                if self._is_inside(path):
                    found.append((path.stat().st_mtime_ns, name))
            except (OSError, msgspec.ValidationError):
                continue
        found.sort(reverse=True)
        there = {name for _, name in found}
        self._known = {name: one for name, one in self._known.items() if name in there}
        entries = [self._entry(self.folder / name) for _, name in found[:_MOST]]
        return Recordings(
            folder=str(self.folder),
            recordings=[entry for entry in entries if entry is not None],
            more=max(0, len(found) - _MOST),
        )

    def path(self, name: str) -> Path:
        """The whole recording of that name; raises CaptureError if there is none in this folder."""
        path = self.folder / name
        if Path(name).name != name or not self._is_inside(path):
            raise CaptureError(f"there is no recording {name!r} in {self.folder}")
        return path

    def _is_inside(self, path: Path) -> bool:
        """Whether it is a file of this folder, and no link to another place."""
        try:
            inside = path.resolve(strict=True).parent == self.folder.resolve(strict=True)
        except OSError:
            return False
        return inside and path.is_file()

    def _entry(self, path: Path) -> Recording | None:
        try:
            found = path.stat()
            seen = (found.st_mtime_ns, found.st_size)
            known = self._known.get(path.name)
            if known is not None and known[0] == seen and known[1].state != "recording":
                return known[1]
            entry = _read(path, found.st_size / 1e6)
        except OSError:
            # Gone meanwhile.
            return None
        self._known[path.name] = (seen, entry)
        return entry


def _read(path: Path, size_mb: float) -> Recording:
    if is_in_use(path):
        return Recording(name=path.name, state="recording", size_mb=size_mb)
    try:
        summary = summarize(path)
    except CaptureError:
        return Recording(name=path.name, state="damaged", size_mb=size_mb)
    return Recording(
        name=path.name,
        state="whole",
        size_mb=round(size_mb, 3),
        rig=summary.rig,
        start_ns=min(summary.start_ns, 2**63 - 1),
        duration_s=round(max(0.0, summary.duration_s), 3),
        messages=summary.messages,
    )
