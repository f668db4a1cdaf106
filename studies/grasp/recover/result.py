"""What recovering gave for one recording: sequences of frames, and each method's run over them.

A JSON file beside the recording that it came from.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.json_file import read_json
from studies.grasp.recover.laws import LawSupport

Numbers = list[float | None]
Outcome = Literal["solved", "unreachable", "not_converged", "not_run"]
SUFFIX = ".recovered.json"


class MethodRun(msgspec.Struct, frozen=True, kw_only=True):
    """One method over one sequence, with fixed lengths or with those measured in each frame."""

    method: str
    lengths: Literal["fixed", "measured"]
    angles_rad: list[Numbers]  # (n, 3)
    iterations: list[int]
    left: Numbers  # (n,) distance from tip to target, the recording's unit
    outcomes: list[Outcome]
    # Of mcp, pip, dip: frames that ended at a limit of the joint.
    at_limit: tuple[int, int, int]
    seconds_a_frame: float
    why_not_run: str = ""


class Sequence(msgspec.Struct, frozen=True, kw_only=True):
    """Frames at equal steps of time, measured and recovered."""

    kind: Literal["closing", "opening", "whole"]
    number: int
    note: str = ""
    times_s: list[float]
    columns: list[Numbers]  # (n, 13) as FingerTrack.columns
    runs: list[MethodRun]


class Recovery(msgspec.Struct, frozen=True, kw_only=True):
    """One recording, recovered."""

    version: Literal[1] = 1
    subject: str
    finger: str
    unit: Literal["mm", "px"]
    source: str
    # Whether lengths and distances mean what their unit says; angles always do.
    lengths_hold: bool
    lengths: tuple[float, float, float]
    lengths_from: str
    limits_deg: list[tuple[float, float]]  # mcp, pip, dip
    law: LawSupport | None = None
    notes: list[str] = []
    incomplete: list[str] = []  # closings and openings that were left out, and why
    sequences: list[Sequence]


def numbers(values: Array) -> Numbers:
    """A row of numbers for a file; what was not measured is null there."""
    return [float(one) if np.isfinite(one) else None for one in values]


def array(rows: list[Numbers]) -> Array:
    """The reverse, (n, k)."""
    return np.array([[np.nan if one is None else one for one in row] for row in rows])


def save_recovery(path: Path, recovery: Recovery) -> None:
    """Write it."""
    path.write_bytes(msgspec.json.encode(recovery) + b"\n")


def load_recovery(path: Path) -> Recovery:
    """Raises CaptureError."""
    return read_json(path, Recovery, "nothing that `rhot grasp recover` wrote; recover again")
