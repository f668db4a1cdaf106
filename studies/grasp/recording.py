"""What one filmed finger gave: joints in its plane, angles, lengths, frame by frame. A JSON file.

Measured from a video, or taken from a recording of a hand; read by what recovers, reports and
compares people. The finger's plane: x along the base line (the back of the hand, or the metacarpal)
towards the finger, y towards the palm, origin at the MCP joint; so that flexion is positive, and
angles are 0 where the finger continues the base line.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import msgspec

from studies.grasp.json_file import read_json

JOINTS = ("mcp", "pip", "dip", "tip")
ANGLES = ("mcp", "pip", "dip")
Joint = Literal["mcp", "pip", "dip", "tip"]
Angle = Literal["mcp", "pip", "dip"]
Finger = Literal["index", "middle", "ring", "little", "thumb"]
Finite = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]
Sigma = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]


class GraspFrame(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One picture's finger. What was not measured is left out, and why stands in the note.

    points: in the unit of the recording, in the finger's plane; tip_direction_rad: of the distal
    phalanx against the base line, the sum of the three angles where all are measured. sigma: one
    standard deviation (of a point along each axis). confidence: 0 not measured .. 1.
    """

    frame: Annotated[int, msgspec.Meta(ge=0)]
    time_s: Finite
    points: dict[Joint, tuple[Finite, Finite]] = {}
    points_sigma: dict[Joint, Sigma] = {}
    angles_rad: dict[Angle, Finite] = {}
    angles_sigma_rad: dict[Angle, Sigma] = {}
    tip_direction_rad: Finite | None = None
    confidence: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 1.0
    note: str = ""


class GraspRecording(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A finger over time. lengths: proximal, middle, distal phalanx in the recording's unit.

    unit: px where nothing in the picture gave a length. method: how the joints were found; truth
    is what a renderer knows.
    """

    version: Literal[1] = 1
    subject: str
    finger: Finger = "index"
    source: str = ""
    method: Literal["dots", "edges", "recording", "truth"]
    unit: Literal["mm", "px"]
    lengths: tuple[Sigma, Sigma, Sigma] | None = None
    lengths_sigma: tuple[Sigma, Sigma, Sigma] | None = None
    notes: list[str] = []
    frames: list[GraspFrame]


def save_recording(path: Path, recording: GraspRecording) -> None:
    """Writes it; one frame a line, so that people and diff can read it."""
    whole = msgspec.json.encode(msgspec.structs.replace(recording, frames=[]))
    lines = b",\n".join(msgspec.json.encode(frame) for frame in recording.frames)
    path.write_bytes(whole.removesuffix(b"[]}") + b"[\n" + lines + b"\n]}\n")


def load_recording(path: Path) -> GraspRecording:
    """Raises CaptureError that says what is wrong and where."""
    return read_json(path, GraspRecording, "no recording of a finger as a grasp study writes it")
