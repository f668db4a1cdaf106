"""The recordings that a command of `rhot grasp` is given: files, folders, recordings of hands."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rhot.errors import CaptureError
from rhot.process.service import rhot_version
from services.cli.progress import Progress
from studies.grasp.recorded.hands import hand_recording
from studies.grasp.recording import Finger, GraspRecording, load_recording

# What `rhot grasp recover` writes beside the recordings that it used.
RECOVERED = ".recovered.json"
# What a folder of a recorded hand holds.
_OF_HANDS = ("truth.jsonl", "poses.jsonl")
_VALID = (
    "give recordings of a finger (.json of a measured or rendered video), folders"
    " with them, or recordings of a hand (Leap .csv, Qualisys .tsv.gz, truth.jsonl, poses.jsonl)"
)


class Named(NamedTuple):
    """A recording, and what its files are called."""

    name: str
    recording: GraspRecording


def load_all(
    paths: Sequence[Path], finger: Finger | None, progress: bool | None
) -> tuple[list[Named], list[str]]:
    """The recordings of that finger (of any, but of a hand's index, where none is named).

    And why others were left out. Raises CaptureError where there is none.
    """
    found: list[tuple[Path, GraspRecording]] = []
    left_out: list[str] = []
    for path in paths:
        for one in _files(path):
            try:
                found.append((one, _loaded(one, finger, progress)))
            except CaptureError as error:
                # A folder may hold other JSON: what a renderer knows, for example.
                if one == path:
                    left_out.append(str(error))
    other = {recording.finger for _, recording in found}
    kept = [(path, r) for path, r in found if finger is None or r.finger == finger]
    if found and not kept:
        raise CaptureError(
            f"no recording of finger {finger}; there are recordings of {', '.join(sorted(other))}"
        )
    left_out += [
        f"{path}: is of the {r.finger}, not of the {finger}"
        for path, r in found
        if finger and r.finger != finger
    ]
    if not kept:
        why = "; ".join(left_out) or f"nothing to recover in {', '.join(map(str, paths))}"
        raise CaptureError(f"{why}. Valid: {_VALID}")
    return _named(kept), left_out


def made_by() -> str:
    """Which version made a page, and when."""
    return f"Made by rhot {rhot_version()} on {datetime.datetime.now(datetime.UTC):%Y-%m-%d}"


def _files(path: Path) -> list[Path]:
    """The files that a path stands for; itself where it is no folder of recordings of fingers."""
    if not path.is_dir() or any((path / name).is_file() for name in _OF_HANDS):
        return [path]
    files = sorted(path.glob("*.json")) or sorted(path.glob("*/*.json"))
    return [one for one in files if not one.name.endswith(RECOVERED)]


def _loaded(path: Path, finger: Finger | None, progress: bool | None) -> GraspRecording:
    if path.suffix == ".json":
        return load_recording(path)
    if not path.exists():
        raise CaptureError(f"{path}: no such file or folder")
    line = Progress("following the hand", 0, progress)
    try:
        return hand_recording(path, finger or "index", line.advance)
    finally:
        line.end()


def _named(found: list[tuple[Path, GraspRecording]]) -> list[Named]:
    """Names of files without their endings; with the folder's where two are alike."""
    stems = [path.name.split(".json")[0].split(".csv")[0].split(".tsv")[0] for path, _ in found]
    named: list[Named] = []
    taken: set[str] = set()
    for (path, recording), stem in zip(found, stems, strict=True):
        name = stem if stems.count(stem) == 1 else f"{path.resolve().parent.name}.{stem}"
        number = 2
        while name in taken:
            name, number = f"{stem}-{number}", number + 1
        taken.add(name)
        named.append(Named(name, recording))
    return named
