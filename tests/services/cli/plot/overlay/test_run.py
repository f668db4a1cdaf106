"""`rhot plot --video`: what was found lies on the pictures, and errors say what is missing."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from rhot.errors import CaptureError, RhotError
from rhot.files.calibration import load_rig_cameras
from rhot.files.capture import read_lines
from rhot.files.config import load_rig
from rhot.hand import JOINT_INDEX
from rhot.messages import HandPose, MarkerFrame
from services.cli.application import application
from services.cli.offline.inputs import job_of
from services.cli.offline.run import run
from services.cli.plot.overlay.run import OverlayRequest, write_overlays


def pictures_of(path: Path) -> list[np.ndarray]:
    video, found = cv2.VideoCapture(str(path)), []
    while True:
        ok, picture = video.read()
        if not ok:
            return found
        found.append(picture)


def lines_of(result: Path, camera: str) -> list[MarkerFrame]:
    lines = read_lines(result / "markers.jsonl", MarkerFrame)
    return [line for line in lines if line.camera == camera]


@pytest.fixture(scope="module")
def short_result(short_capture, tmp_path_factory) -> Path:
    """Half a second, as encoding takes ten times as long as tracking."""
    folder = tmp_path_factory.mktemp("tracked") / "short"
    run(job_of([str(short_capture)], None), folder)
    return folder


@pytest.fixture(scope="module")
def overlay(short_result, tmp_path_factory) -> Path:
    """Both videos of the result, by the command."""
    out = tmp_path_factory.mktemp("overlay")
    words = ["plot", str(short_result), "--video", "--out", str(out)]
    ran = CliRunner().invoke(application(), words)
    assert ran.exit_code == 0, ran.stderr
    assert "overlay_left.webm: 15 pictures, 0.5 s, at a constant" in ran.stdout
    return out


def test_each_camera_has_its_video_in_real_time(overlay, short_result):
    assert sorted(path.name for path in overlay.iterdir()) == [
        "overlay_left.webm",
        "overlay_right.webm",
    ]
    for camera in ("left", "right"):
        pictures = pictures_of(overlay / f"overlay_{camera}.webm")
        assert abs(len(pictures) - len(lines_of(short_result, camera))) <= 1
        assert pictures[0].shape == (480, 640, 3)


def test_what_was_found_is_drawn_where_it_is(overlay, short_result, short_capture):
    """Ink where markers and joints are; what nothing is drawn on stays as filmed."""
    drawn = pictures_of(overlay / "overlay_left.webm")
    filmed = pictures_of(short_capture / "left.mkv")
    lines = lines_of(short_result, "left")
    camera = load_rig_cameras(load_rig(short_capture / "rig.toml"))["left"]
    poses = list(read_lines(short_result / "poses.jsonl", HandPose))
    for number in (4, 8, 12):
        changed = np.abs(drawn[number].astype(int) - filmed[number]).max(axis=2) > 80
        for marker in lines[number].markers:
            x, y = round(marker.x_px), round(marker.y_px)
            assert changed[y - 8 : y + 9, x - 8 : x + 9].any(), marker.color
        pose = min(poses, key=lambda one: abs(one.stamp_ns - lines[number].stamp_ns))
        joints_px = camera.project([joint.position_m for joint in pose.joints])
        for name in ("wrist", "index_proximal", "index_tip", "thumb_distal", "little_tip"):
            x, y = np.round(joints_px[JOINT_INDEX[name]]).astype(int)
            assert changed[y - 6 : y + 7, x - 6 : x + 7].any(), name
        assert changed[:100, 420:].mean() > 0.02
        # The left edge, above the time: noise alone.
        assert not changed[:440, :40].any()


def copied(result: Path, tmp_path: Path, **origin) -> Path:
    """A result whose origin is another."""
    folder = tmp_path / "copied"
    shutil.copytree(result, folder)
    summary = msgspec.json.decode((folder / "summary.json").read_bytes())
    summary["origin"] = {**summary["origin"], **origin} if origin else None
    (folder / "summary.json").write_bytes(msgspec.json.encode(summary))
    return folder


def test_pictures_that_are_gone_are_asked_for(result, short_capture, tmp_path):
    moved = copied(result, tmp_path, sources=[str(tmp_path / "gone")])
    with pytest.raises(CaptureError, match=r"gone: what was tracked is no longer.*--pictures"):
        list(write_overlays(OverlayRequest(moved), tmp_path))
    request = OverlayRequest(moved, [f"left={short_capture / 'left.mkv'}"])
    with pytest.raises(RhotError, match=r"no --config rig\.toml"):
        list(write_overlays(request, tmp_path / "out"))


def test_what_has_no_pictures_says_so(result, recording, tmp_path):
    unknown = copied(result, tmp_path)
    with pytest.raises(CaptureError, match="does not say which pictures it is of; give them with"):
        list(write_overlays(OverlayRequest(unknown), tmp_path))
    of_markers = copied(result, tmp_path / "more", sources=[str(recording)])
    with pytest.raises(CaptureError, match="tracked from markers, without pictures"):
        list(write_overlays(OverlayRequest(of_markers), tmp_path))
    ran = CliRunner().invoke(application(), ["plot", str(recording), "--pictures", "x"])
    assert "--pictures is what --video draws onto" in str(ran.exception)


def test_pictures_of_another_size_are_not_of_this_result(result, short_capture, tmp_path):
    small = tmp_path / "small.mkv"
    codec = cv2.VideoWriter_fourcc(*"FFV1")
    writer = cv2.VideoWriter(str(small), cv2.CAP_FFMPEG, codec, 30.0, (64, 48))
    for _ in range(5):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()
    request = OverlayRequest(result, [f"left={small}"], short_capture / "rig.toml")
    with pytest.raises(CaptureError, match=r"are 64 x 48, those that were tracked 640 x 480"):
        list(write_overlays(request, tmp_path / "out"))
    assert not list((tmp_path / "out").iterdir())


def test_a_recording_is_drawn_onto_the_pictures_it_is_of(recording, short_capture, tmp_path):
    words = ["plot", str(recording), "--video", "--pictures", f"left={short_capture / 'left.mkv'}"]
    ran = CliRunner().invoke(application(), [*words, "--out", str(tmp_path)])
    assert ran.exit_code == 0, ran.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["overlay_left.webm"]
    # Half a second of the recording's two.
    assert len(pictures_of(tmp_path / "overlay_left.webm")) in (15, 16)
