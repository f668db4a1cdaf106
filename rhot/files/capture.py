"""The capture folder: rig.toml, calibration/, <camera>.mkv + <camera>.csv, objects.jsonl,
truth.jsonl.

Written by the simulator and by recordings of the real rig, read by `rhot track`. Pictures are the
frame sources' matter (services/pi_tracker/sources); here is what can be read without OpenCV. A
broken line is a CaptureError with its number.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec

from rhot.errors import UNDECODABLE, CaptureError, writing

M = TypeVar("M", bound=msgspec.Struct)
CSV_HEADER = ("frame", "stamp_ns", "row_time_ns")


@dataclass(frozen=True)
class Capture:
    """Paths of one capture folder."""

    folder: Path

    @property
    def rig_toml(self) -> Path:
        return self.folder / "rig.toml"

    @property
    def truth(self) -> Path:
        return self.folder / "truth.jsonl"

    @property
    def objects(self) -> Path:
        return self.folder / "objects.jsonl"

    @property
    def markers(self) -> Path:
        """Of a capture without pictures."""
        return self.folder / "markers.jsonl"

    def video(self, camera: str) -> Path:
        return self.folder / f"{camera}.mkv"

    def stamps(self, camera: str) -> Path:
        return self.folder / f"{camera}.csv"


@dataclass(frozen=True)
class FrameStamp:
    """One row of <camera>.csv: stamp_ns is mid-exposure of row 0 on the camera's own clock."""

    frame: int
    stamp_ns: int
    row_time_ns: float


def read_stamps(path: Path) -> list[FrameStamp]:
    """All rows of a <camera>.csv.

    Raises CaptureError naming the file and line of the first bad row.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CaptureError(f"{path}: cannot be read: {error}") from None
    if not rows or tuple(cell.strip() for cell in rows[0]) != CSV_HEADER:
        raise CaptureError(f"{path}: line 1: expected the header `{','.join(CSV_HEADER)}`")
    return [_stamp(path, number, row) for number, row in enumerate(rows[1:], start=2) if row]


def _stamp(path: Path, number: int, row: list[str]) -> FrameStamp:
    try:
        frame, stamp_ns, row_time_ns = row
        return FrameStamp(int(frame), int(stamp_ns), float(row_time_ns))
    except ValueError:
        raise CaptureError(
            f"{path}: line {number}: expected three numbers `{','.join(CSV_HEADER)}`, "
            f"got {','.join(row)!r}"
        ) from None


def write_stamps(path: Path, stamps: Iterable[FrameStamp]) -> None:
    """Write a <camera>.csv. Raises DiskFullError."""
    with writing(path), path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_HEADER)
        writer.writerows((s.frame, s.stamp_ns, f"{s.row_time_ns:.10g}") for s in stamps)


def read_lines(path: Path, kind: type[M]) -> Iterator[M]:
    """The messages of a .jsonl file, one after the other.

    Raises CaptureError naming the file and line of the first bad one.
    """
    decoder = msgspec.json.Decoder(kind)
    try:
        with path.open("rb") as file:
            for number, line in enumerate(file, start=1):
                if line.strip():
                    try:
                        yield decoder.decode(line)
                    except UNDECODABLE as error:
                        raise CaptureError(
                            f"{path}: line {number}: not a {kind.__name__}: {error}"
                        ) from None
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read: {error}") from None


def write_lines(path: Path, messages: Iterable[msgspec.Struct]) -> int:
    """Write messages as .jsonl; returns how many. Raises DiskFullError."""
    count = 0
    with writing(path), path.open("wb") as file:
        for message in messages:
            file.write(msgspec.json.encode(message) + b"\n")
            count += 1
    return count
