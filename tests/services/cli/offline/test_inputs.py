"""What `rhot track` reads, and its errors for everything else."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot.errors import CalibrationError, CaptureError, ConfigError
from rhot.files.capture import FrameStamp, write_stamps
from services.cli.offline.inputs import job_of
from services.cli.offline.track_summary import Origin

RIG = '[rig]\nname = "r"\n[[camera]]\nname = "left"\n[[camera]]\nname = "right"\n'


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    return path


def video(path, frames=12):
    writer = cv2.VideoWriter(
        str(path), cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*"FFV1"), 20.0, (64, 48)
    )
    for value in range(frames):
        writer.write(np.full((48, 64, 3), 5 * value, np.uint8))
    writer.release()
    return path


def test_a_capture_gives_its_cameras_in_the_order_of_its_rig(short_capture):
    job = job_of([str(short_capture)], None)
    assert [one.camera for one in job.inputs] == ["left", "right"]
    assert [one.total > 10 for one in job.inputs] == [True, True]
    assert job.objects == short_capture / "objects.jsonl"
    frames = list(job.inputs[0].frames())
    assert len(frames) == job.inputs[0].total
    assert not job.inputs[0].warnings


def test_videos_come_in_the_order_of_the_rig_with_stamps_from_their_frame_rate(tmp_path, rig):
    v = video(tmp_path / "v.mkv")
    job = job_of([f"right={v}", f"left={v}"], rig)
    assert [one.camera for one in job.inputs] == ["left", "right"]
    assert [one.clock_sigma_ns for one in job.inputs] == [-1, -1]
    assert [frame.stamp_ns for frame in job.inputs[1].frames()][:3] == [0, 50_000_000, 100_000_000]


def test_a_csv_beside_the_video_has_its_stamps(tmp_path, rig):
    v = video(tmp_path / "v.mkv")
    write_stamps(tmp_path / "v.csv", [FrameStamp(i, 1000 + 40 * i, 30.0) for i in range(12)])
    (one,) = job_of([f"left={v}"], rig).inputs
    assert [(f.stamp_ns, f.row_time_ns) for f in one.frames()][1] == (1040, 30.0)
    assert one.clock_sigma_ns > 0


def test_a_csv_of_something_else_gives_a_note_and_is_not_used(tmp_path, rig):
    v = video(tmp_path / "v.mkv")
    (tmp_path / "v.csv").write_text("name,age\nx,3\n")
    (one,) = job_of([f"left={v}"], rig).inputs
    assert "no list of stamps" in one.notes[0]


def test_a_csv_with_fewer_rows_than_the_video_ends_it_with_a_warning(tmp_path, rig):
    v = video(tmp_path / "v.mkv")
    write_stamps(tmp_path / "v.csv", [FrameStamp(i, 40 * i, 30.0) for i in range(5)])
    (one,) = job_of([f"left={v}"], rig).inputs
    assert len(list(one.frames())) == 5
    assert "5 frames" in one.warnings[0]


def test_stamps_that_run_backwards_end_the_camera_with_a_warning(tmp_path, rig):
    v = video(tmp_path / "v.mkv")
    write_stamps(tmp_path / "v.csv", [FrameStamp(i, 40 * (i % 7), 30.0) for i in range(12)])
    (one,) = job_of([f"left={v}"], rig).inputs
    assert len(list(one.frames())) == 7
    assert "stamps are damaged" in one.warnings[0]


def test_a_rig_without_cameras_takes_any_name(tmp_path):
    (tmp_path / "rig.toml").write_text('[rig]\nname = "r"\n')
    job = job_of([f"cam={video(tmp_path / 'v.mkv')}"], tmp_path / "rig.toml")
    assert [camera.name for camera in job.config.camera] == ["cam"]


@pytest.mark.parametrize(
    ("sources", "error", "text"),
    [
        (["middle=v.mkv"], ConfigError, r"no camera 'middle'; it has \['left', 'right'\]"),
        (["left=a.mkv", "left=b.mkv"], ConfigError, "given twice"),
        (["left="], ConfigError, "not CAM=VIDEO"),
        (["=a.mkv"], ConfigError, "not CAM=VIDEO"),
        (["le/ft=a.mkv"], ConfigError, "cannot name a camera"),
        (["left=a.mkv", "b.mkv"], ConfigError, "not CAM=VIDEO"),
        (["a", "b"], ConfigError, "one CAPTURE folder or CAM=VIDEO"),
        (["nowhere"], CaptureError, "no such folder"),
    ],
)
def test_arguments_that_make_no_sense(rig, sources, error, text):
    with pytest.raises(error, match=text):
        job_of(sources, rig)


def test_a_video_needs_a_configuration_and_a_capture_brings_its_own(tmp_path):
    with pytest.raises(ConfigError, match="2 videos need --config"):
        job_of(["left=a.mkv", "right=b.mkv"], None)
    with pytest.raises(CaptureError, match=r"no rig\.toml"):
        job_of([str(tmp_path)], None)
    with pytest.raises(CaptureError, match=r"is a file; .*CAM="):
        job_of([str(video(tmp_path / "v.mkv"))], None)


def test_one_video_needs_no_rig_but_the_ranges_of_its_colours(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source = f"cam={video(tmp_path / 'v.mkv')}"
    with pytest.raises(CalibrationError, match=r"rhot calibrate colors cam --video .*v\.mkv"):
        job_of([source], None)
    colors = '{"colors": {"green": {"hsv_low": [35, 60, 40], "hsv_high": [85, 255, 255]}}}'
    (tmp_path / "calibration").mkdir()
    (tmp_path / "calibration" / "cam.colors.json").write_text(colors)
    job = job_of([source], None, colors=["green"])
    assert (job.cameras, job.colors, job.config.hand) == (["cam"], ("green",), {})
    with pytest.raises(CalibrationError, match=r"--color red: is not in .* which has green"):
        job_of([source], None, colors=["red"])


def test_colours_are_not_named_where_a_hand_wears_them(short_capture):
    with pytest.raises(ConfigError, match=r"--color is for a video without rig\.toml"):
        job_of([str(short_capture)], None, colors=["blue"])


def test_what_was_asked_for_is_remembered_with_whole_paths(tmp_path, rig, monkeypatch):
    video(tmp_path / "v.mkv")
    monkeypatch.chdir(tmp_path)
    origin = job_of(["left=v.mkv"], Path("rig.toml"), ["left=20"]).origin
    assert origin == Origin(
        sources=[f"left={tmp_path / 'v.mkv'}"], config=str(rig), rates=["left=20"]
    )


def test_a_missing_video_is_an_error_with_its_name(tmp_path, rig):
    (one,) = job_of([f"left={tmp_path / 'gone.mkv'}"], rig).inputs
    with pytest.raises(CaptureError, match=r"gone\.mkv"):
        list(one.frames())


def test_a_truncated_video_gives_its_frames_and_a_warning(copy):
    data = (copy / "left.mkv").read_bytes()
    (copy / "left.mkv").write_bytes(data[: len(data) // 2])
    left, right = job_of([str(copy)], None).inputs
    assert 3 < len(list(left.frames())) < left.total
    assert "left.mkv" in left.warnings[0]
    assert len(list(right.frames())) == right.total


def test_a_broken_row_of_stamps_names_file_and_line(copy):
    rows = (copy / "right.csv").read_text().splitlines()
    rows[4] = "3,soon,30000"
    (copy / "right.csv").write_text("\n".join(rows))
    right = job_of([str(copy)], None).inputs[1]
    with pytest.raises(CaptureError, match=r"right\.csv: line 5"):
        list(right.frames())


def stamps_of(job):
    return [[frame.stamp_ns for frame in one.frames()] for one in job.inputs]


def test_a_rate_by_hand_is_of_all_videos_or_of_one(tmp_path, rig):
    v = video(tmp_path / "v.mkv")
    pairs = [f"left={v}", f"right={v}"]
    left, right = stamps_of(job_of(pairs, rig, ["10"]))
    assert left[:3] == right[:3] == [0, 100_000_000, 200_000_000]
    left, right = stamps_of(job_of(pairs, rig, ["right=25"]))
    assert (left[1], right[1]) == (50_000_000, 40_000_000)


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        ("fast", r"--fps fast: give frames a second, 0\.1 to 1000, e\.g\. --fps 30"),
        ("0", r"--fps 0: give frames a second"),
        ("top=30", r"no video of a camera 'top'; there are \['left'\]"),
    ],
)
def test_a_rate_that_cannot_be_is_refused(tmp_path, rig, rate, message):
    v = video(tmp_path / "v.mkv")
    with pytest.raises(ConfigError, match=message):
        job_of([f"left={v}"], rig, [rate])


def test_a_capture_takes_no_rate(short_capture):
    with pytest.raises(ConfigError, match="a capture has the stamps of its frames"):
        job_of([str(short_capture)], None, ["30"])
