"""A calibrated rig with a painted cup and a pen, and a recording of the cup being moved."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot.files.capture import write_lines
from testing.painted_tracker import PaintedTracker, write_cameras

RIG_TOML = """[rig]
name = "desk"
[bus]
connect = ["{endpoint}"]
[[camera]]
name = "left"
source = "simulator"
[[camera]]
name = "right"
source = "simulator"
[hand.right.markers]
index_tip = "blue"
[[object]]
name = "cup"
serial = "LHR-1"
marker = "orange"
[[object]]
name = "pen"
serial = "LHR-2"
[objects]
source = "network"
"""


@pytest.fixture
def scene() -> PaintedTracker:
    """24 s, and stamps that are 30 ms late."""
    return PaintedTracker(seconds=24.0, time_offset_s=0.03, seed=3)


@pytest.fixture
def rig_toml(tmp_path: Path, scene: PaintedTracker, endpoint: str) -> Path:
    """The rig; its router need not be there."""
    write_cameras(scene, tmp_path / "calibration")
    path = tmp_path / "rig.toml"
    path.write_text(RIG_TOML.format(endpoint=endpoint))
    return path


@pytest.fixture
def recording(tmp_path: Path, scene: PaintedTracker) -> Path:
    """markers.jsonl and objects.jsonl."""
    folder = tmp_path / "recording"
    folder.mkdir()
    write_lines(folder / "markers.jsonl", scene.frames())
    write_lines(folder / "objects.jsonl", scene.poses())
    return folder
