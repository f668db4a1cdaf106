"""What a report is about: all recoveries of a folder with their recordings, by person and finger.

Pure but for reading the files.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from studies.grasp.recording import GraspRecording, load_recording
from studies.grasp.recover.result import (
    SUFFIX,
    MethodRun,
    Recovery,
    Sequence,
    array,
    load_recovery,
)
from studies.grasp.track import FingerTrack, track_of_columns

# Methods whose angles stand for the measured ones where none were, the best first.
_STAND_INS = ("dls", "dls-position", "closed-form", "fabrik")


class Entry(NamedTuple):
    """One recording."""

    name: str
    recording: GraspRecording | None  # None: its file is not beside the recovery
    recovery: Recovery


@dataclass(frozen=True)
class Person:
    """All recordings of one finger of one person."""

    subject: str
    finger: str
    entries: list[Entry]

    @property
    def label(self) -> str:
        """How figures and tables call them."""
        return self.subject if self.finger == "index" else f"{self.subject}, {self.finger}"

    @property
    def unit(self) -> str:
        """Of lengths; `?` where they do not hold what their unit says."""
        first = self.entries[0].recovery
        return first.unit if first.lengths_hold else "?"

    @property
    def sequences(self) -> list[tuple[Recovery, Sequence]]:
        """All of them, in the order of the recordings."""
        return [(e.recovery, one) for e in self.entries for one in e.recovery.sequences]

    @property
    def has_angles(self) -> bool:
        """Whether angles were measured in any frame."""
        return any(
            np.isfinite(track_of(one).angles_rad).all(axis=1).any() for _, one in self.sequences
        )


def load_study(folder: Path) -> list[Person]:
    """Raises CaptureError where there is nothing to report."""
    files = sorted(folder.glob(f"*{SUFFIX}")) if folder.is_dir() else []
    if not files:
        reason = "no such folder" if not folder.exists() else f"holds no {SUFFIX[1:]}"
        raise CaptureError(
            f"{folder}: {reason}; give the folder that `rhot grasp recover RECORDING... --out`"
            " wrote"
        )
    people: dict[tuple[str, str], list[Entry]] = {}
    for path in files:
        recovery = load_recovery(path)
        name = path.name.removesuffix(SUFFIX)
        beside = path.with_name(f"{name}.json")
        recording = load_recording(beside) if beside.is_file() else None
        if recovery.sequences:
            entry = Entry(name, recording, recovery)
            people.setdefault((recovery.subject, recovery.finger), []).append(entry)
    if not people:
        raise CaptureError(f"{folder}: none of its recordings has a sequence of frames")
    return [Person(*key, entries) for key, entries in people.items()]


def track_of(sequence: Sequence) -> FingerTrack:
    """Its measured frames."""
    return track_of_columns(np.array(sequence.times_s), array(sequence.columns))


def run_of(sequence: Sequence, method: str, lengths: str = "fixed") -> MethodRun | None:
    """A method's run that gave angles, or None."""
    for run in sequence.runs:
        if run.method == method and run.lengths == lengths and not run.why_not_run:
            return run
    return None


def angles_of(sequence: Sequence) -> tuple[Array, str]:
    """Angles (n, 3) rad and where they come from: measured, or a method's name."""
    measured = track_of(sequence).angles_rad
    if np.isfinite(measured).all(axis=1).mean() > 0.5:
        return measured, "measured"
    for method in _STAND_INS:
        run = run_of(sequence, method)
        if run is not None:
            return array(run.angles_rad), method
    return measured, "measured"


def same_length(people: list[Person]) -> bool:
    """Whether all sequences have as many frames, so that means over frames make sense."""
    counts = {len(one.times_s) for person in people for _, one in person.sequences}
    return len(counts) == 1
