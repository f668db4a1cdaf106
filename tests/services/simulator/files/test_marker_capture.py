"""Captures without pictures: the same bytes each time, and only into a new folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot.errors import CaptureError
from rhot.files.calibration import load_hand
from rhot.files.config import RigConfig, load_rig
from services.simulator.files.marker_capture import write_marker_capture
from services.simulator.recorded_motion.scenes import MotionView, load_motion, point_scene


def test_the_same_recording_gives_the_same_bytes(
    config: RigConfig, rhot_data: Path, tmp_path: Path
) -> None:
    recorded = load_motion(rhot_data / "hand_motion/qualisys/recording.tsv.gz")
    scene = point_scene(config, recorded, MotionView(seconds=0.5))
    counts = {write_marker_capture(scene, 0.5, tmp_path / name) for name in "ab"}
    assert counts == {len((tmp_path / "a" / "markers.jsonl").read_text().splitlines())}
    for path in (tmp_path / "a").rglob("*"):
        if path.is_file():
            other = tmp_path / "b" / path.relative_to(tmp_path / "a")
            assert path.read_bytes() == other.read_bytes()
    rig = load_rig(tmp_path / "a" / "rig.toml")
    hand = load_hand(rig.calibration_dir, "right", 1.0)
    assert {(dab.radius_m, dab.extent_m) for dab in hand.paint.values()} == {(0.0, 0.0)}
    with pytest.raises(CaptureError, match="not an empty folder"):
        write_marker_capture(scene, 0.5, tmp_path / "a")
