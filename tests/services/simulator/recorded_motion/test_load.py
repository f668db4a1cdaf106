"""Recordings are told apart by what is in them, and what is none says so."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from rhot.errors import CaptureError
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints, RecordedPoints


def test_real_recordings_are_read(rhot_data: Path) -> None:
    leap = load_recording(rhot_data / "hand_motion/leap/grab.csv")
    assert isinstance(leap, RecordedJoints)
    assert leap.hand == "right"
    assert leap.times_s[-1] == pytest.approx(3.304, abs=1e-3)
    # Right-handed axes, and bones that do not change.
    np.testing.assert_allclose(np.linalg.det(leap.axes), 1.0, atol=1e-9)
    lengths = np.linalg.norm(np.diff(leap.joints_m, axis=2), axis=3)
    assert lengths.std(axis=0).max() < 1e-6
    glove = load_recording(rhot_data / "hand_motion/qualisys/recording.tsv.gz")
    assert isinstance(glove, RecordedPoints)
    assert glove.hand == "right"
    assert glove.points_m.shape == (6000, 6, 3)
    # The thumb's tip was hidden in 493 frames, the wrist never.
    assert np.isnan(glove.points_m[:, 1, 0]).sum() == 493
    assert np.isfinite(glove.points_m[:, 0]).all()


def test_what_is_no_recording_says_what_is_valid(tmp_path: Path) -> None:
    texts = {
        "": "it is empty",
        "frame,stamp_ns,row_time_ns\n0,1,2\n": "it begins with 'frame,stamp_ns",
        "timestamp_us,hand_type,palm_x\n1,right,2\n": "without palm_y",
        "NO_OF_FRAMES\t3\nFrame\tTime\thand_top X\n": "no marker hand_left",
        '{"camera":"left","markers":[]}\n': "neither a line of truth.jsonl nor of poses.jsonl",
        '{"hands":{}}\n': "line 1: not a Truth",
        "{broken\n": "is no JSON object",
    }
    for number, (text, message) in enumerate(texts.items()):
        path = tmp_path / f"{number}.txt"
        path.write_text(text)
        with pytest.raises(CaptureError, match=message):
            load_recording(path)
    binary = tmp_path / "binary"
    binary.write_bytes(bytes(range(128, 256)))
    with pytest.raises(CaptureError, match="is no text"):
        load_recording(binary)
    cut = tmp_path / "cut.tsv.gz"
    cut.write_bytes(gzip.compress(b"NO_OF_FRAMES" * 100)[:30])
    with pytest.raises(CaptureError, match="cannot be read"):
        load_recording(cut)
    with pytest.raises(CaptureError, match=r"has neither truth\.jsonl nor poses\.jsonl"):
        load_recording(tmp_path)


def test_a_broken_cell_is_named_by_its_line(rhot_data: Path, tmp_path: Path) -> None:
    lines = (rhot_data / "hand_motion/leap/wave.csv").read_text().splitlines()
    cells = lines[7].split(",")
    cells[30] = "much"
    lines[7] = ",".join(cells)
    path = tmp_path / "broken.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(CaptureError, match="line 8"):
        load_recording(path)


def test_the_longest_stretch_without_a_long_gap_is_taken(rhot_data: Path, tmp_path: Path) -> None:
    lines = (rhot_data / "hand_motion/leap/grab.csv").read_text().splitlines()
    path = tmp_path / "gap.csv"
    # 20 frames lost after 60; a frame told twice.
    path.write_text("\n".join([*lines[:61], *lines[81:], lines[-1]]))
    found = load_recording(path)
    assert len(found.times_s) == len(lines) - 81
    assert found.times_s[0] == 0.0
    assert np.all(np.diff(found.times_s) > 0.0)
    path.write_text("\n".join(lines[:4]))
    with pytest.raises(CaptureError, match="needs at least four frames"):
        load_recording(path)
