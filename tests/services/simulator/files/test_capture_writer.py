"""Captures: complete, exact, the same again, and never over other files."""

from __future__ import annotations

import filecmp
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot.errors import CaptureError, DiskFullError
from rhot.files.capture import Capture, read_lines, read_stamps
from rhot.files.config import load_rig
from rhot.messages.objects import OpenVrPose
from rhot.messages.simulator import Truth
from services.simulator.camera.frame_source import FrameSource
from services.simulator.files.capture_writer import START_NS, write_capture
from services.simulator.files.mkv_ids import fix_identifiers, is_cut_off
from services.simulator.scene.scene import Scene

SECONDS = 0.5


@pytest.fixture(scope="module")
def folder(fist: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("simulated") / "capture"
    calls: list[tuple[int, int]] = []
    written = write_capture(fist, SECONDS, folder, lambda done, total: calls.append((done, total)))
    assert calls == [(k + 1, len(calls)) for k in range(len(calls))]
    assert written == sum(len(read_stamps(Capture(folder).stamps(name))) for name in fist.cameras)
    return folder


def test_pictures_come_back_bit_for_bit(fist, folder, planes):
    for name in fist.cameras:
        source = FrameSource(fist, name, recorded=True)
        kept = [
            taken
            for k in range(source.clock.first_frame(SECONDS))
            if (taken := source.take(k, START_NS)).image is not None
        ]
        stamps = read_stamps(Capture(folder).stamps(name))
        video = cv2.VideoCapture(str(Capture(folder).video(name)))
        pictures = []
        while (read := video.read())[0]:
            pictures.append(read[1])
        assert len(pictures) == len(stamps) == len(kept)
        assert [s.frame for s in stamps] == list(range(len(stamps)))
        for bgr, stamp, taken in zip(pictures, stamps, kept, strict=True):
            assert stamp.stamp_ns == taken.stamp_ns
            assert stamp.row_time_ns == pytest.approx(taken.row_time_ns)
            b, g, r = (bgr[..., i].astype(float) for i in range(3))
            y, u, v = planes(taken.image)
            np.testing.assert_allclose(16 + 0.257 * r + 0.504 * g + 0.098 * b, y, atol=1.01)
            mean = (
                (128 - 0.148 * r - 0.291 * g + 0.439 * b).reshape(240, 2, 320, 2).mean(axis=(1, 3))
            )
            # Grey levels clip in BGR where YUV would not: a few pixels of saturated paint.
            assert np.mean(np.abs(mean - u) > 1.0) < 0.001
            mean = (
                (128 + 0.439 * r - 0.368 * g - 0.071 * b).reshape(240, 2, 320, 2).mean(axis=(1, 3))
            )
            assert np.mean(np.abs(mean - v) > 1.0) < 0.001


def test_truth_is_at_the_first_cameras_instants_on_the_masters_clock(fist, folder):
    lines = list(read_lines(Capture(folder).truth, Truth))
    clock = fist.clocks["left"]
    assert [line.stamp_ns for line in lines] == [
        START_NS + round(clock.time_s(k) * 1e9) for k in range(len(lines))
    ]
    assert len(lines) == clock.first_frame(SECONDS)
    assert lines[7] == fist.truth(clock.time_s(7), lines[7].stamp_ns)


def test_objects_at_their_rate(fist, folder):
    lines = list(read_lines(Capture(folder).objects, OpenVrPose))
    rate_hz = fist.config.objects.rate_hz
    assert len(lines) == round(SECONDS * rate_hz)
    assert {line.device.serial for line in lines} == {"LHR-SIM00001"}
    assert np.diff([line.stamp_ns for line in lines]) == pytest.approx(1e9 / rate_hz, abs=1)


def test_the_rig_stands_alone(fist, folder):
    rig = load_rig(folder / "rig.toml")
    assert {c.source for c in rig.camera} == {"capture:."}
    assert rig.calibration_dir == folder / "calibration"
    assert rig.hand == fist.config.hand
    for path in fist.config.calibration_dir.glob("*.json"):
        assert filecmp.cmp(path, folder / "calibration" / path.name, shallow=False)


def test_the_same_again_is_the_same_bytes(fist, folder, tmp_path):
    write_capture(fist, SECONDS, tmp_path / "again")
    names = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())
    assert names == sorted(
        str(p.relative_to(tmp_path / "again"))
        for p in (tmp_path / "again").rglob("*")
        if p.is_file()
    )
    _, different, odd = filecmp.cmpfiles(folder, tmp_path / "again", names, shallow=False)
    assert (different, odd) == ([], [])


def test_nothing_is_overwritten(fist, tmp_path):
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(CaptureError, match="not an empty folder"):
        write_capture(fist, SECONDS, tmp_path)
    with pytest.raises(CaptureError, match="not an empty folder"):
        write_capture(fist, SECONDS, tmp_path / "note.txt")
    with pytest.raises(CaptureError, match="cannot be made"):
        write_capture(fist, SECONDS, tmp_path / "note.txt" / "below")
    with pytest.raises(CaptureError, match="duration"):
        write_capture(fist, 0.0, tmp_path / "new")
    assert [p.name for p in tmp_path.iterdir()] == ["note.txt"]


@pytest.mark.parametrize("content", [b"", b"\x00" * 64, b"RIFF....AVI LIST", bytes(range(256)) * 8])
def test_files_of_another_layout_stay_as_they_are(tmp_path, content):
    path = tmp_path / "other.mkv"
    path.write_bytes(content)
    fix_identifiers(path, 1)
    assert path.read_bytes() == content


def test_truth_lines_are_plain_json(folder):
    first = json.loads(Capture(folder).truth.read_text().splitlines()[0])
    right = first["hands"]["right"]
    assert set(right) == {"points_m", "wrist", "angles_rad"}
    assert len(right["points_m"]["index_tip"]) == 3
    assert set(right["angles_rad"]["index"]) >= {"abduction", "mcp", "pip", "dip"}
    cup = first["objects"]["cup"]
    assert set(cup) == {"position_m", "orientation_wxyz", "contacts", "held_by"}


def test_a_video_that_does_not_fit_on_the_disk_is_one_line(fist, tmp_path, small_files):
    """OpenCV says nothing when its writes fail."""
    with pytest.raises(DiskFullError, match=r"\.mkv: was cut off: no space left"):
        write_capture(fist, SECONDS, tmp_path / "capture")


def test_a_video_that_is_cut_off_is_known(folder, fist, tmp_path):
    whole = Capture(folder).video(next(iter(fist.cameras)))
    assert not is_cut_off(whole)
    content = whole.read_bytes()
    for length in (0, 10, 300, len(content) // 2, len(content) - 1):
        (tmp_path / "cut.mkv").write_bytes(content[:length])
        assert is_cut_off(tmp_path / "cut.mkv"), length
