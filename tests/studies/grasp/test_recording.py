"""A recording of a finger: written, read, refused."""

from __future__ import annotations

import pytest

from rhot.errors import CaptureError
from studies.grasp.recording import GraspFrame, GraspRecording, load_recording, save_recording

RECORDING = GraspRecording(
    subject="anna",
    method="dots",
    unit="mm",
    lengths=(43.6, 26.9, 18.2),
    frames=[
        GraspFrame(
            frame=0,
            time_s=0.0,
            points={"mcp": (0.0, 0.0), "tip": (88.0, 1.5)},
            angles_rad={"mcp": 0.1},
            tip_direction_rad=0.3,
        ),
        GraspFrame(frame=1, time_s=0.033, confidence=0.0, note="the tip is out of view"),
    ],
)


def test_it_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "anna.json"
    save_recording(path, RECORDING)
    assert load_recording(path) == RECORDING
    assert path.read_text().count("\n") == len(RECORDING.frames) + 2


def test_one_without_frames_too(tmp_path):
    path = tmp_path / "none.json"
    empty = GraspRecording(subject="anna", method="edges", unit="px", frames=[])
    save_recording(path, empty)
    assert load_recording(path) == empty


@pytest.mark.parametrize(
    "text", [b"", b"[]", b"\xff", b"[" * 100_000, b'{"subject": "a", "frames": []}']
)
def test_anything_else_is_refused_with_its_name(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_bytes(text)
    with pytest.raises(CaptureError, match=r"other\.json: is no recording of a finger"):
        load_recording(path)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(CaptureError, match="cannot be read"):
        load_recording(tmp_path / "none.json")
