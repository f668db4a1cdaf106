"""Recordings: videos, captures, folders, whole and broken."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.errors import CaptureError
from rhot.files.capture import FrameStamp, write_stamps
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.video import VideoReader

SIZE = (64, 48)


def images(count, size=SIZE):
    """Different pictures, each with its number as its grey."""
    rng = np.random.default_rng(0)
    return [
        np.clip(10 * n + rng.integers(0, 20, (size[1], size[0], 3)), 0, 255).astype(np.uint8)
        for n in range(count)
    ]


def write_video(path, pictures, fps=20.0):
    """A lossless video."""
    height, width = pictures[0].shape[:2]
    code = cv2.VideoWriter_fourcc(*"FFV1")
    writer = cv2.VideoWriter(
        str(path), cv2.CAP_FFMPEG, code, fps, (width, height), pictures[0].ndim == 3
    )
    for picture in pictures:
        writer.write(picture)
    writer.release()


def read_all(reader):
    """Frames until the end, then closed."""
    reader.open()
    frames = []
    try:
        while (frame := reader.read()) is not None:
            frames.append(frame)
    finally:
        reader.close()
    return frames


def cut(path, share):
    """Break a file off."""
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])


@pytest.fixture
def capture(tmp_path):
    """A capture folder with two cameras of five frames."""
    for name, first_ns in (("left", 1_000_000_000), ("right", 1_004_000_000)):
        write_video(tmp_path / f"{name}.mkv", images(5))
        write_stamps(
            tmp_path / f"{name}.csv",
            [FrameStamp(n, first_ns + n * 50_000_000, 33_700.5) for n in range(5)],
        )
    return tmp_path


def test_a_video_has_stamps_from_its_frame_rate(tmp_path):
    pictures = images(6)
    write_video(tmp_path / "a.mkv", pictures)
    frames = read_all(VideoReader("left", tmp_path / "a.mkv", 99.0, start_ns=7))
    assert [frame.seq for frame in frames] == list(range(6))
    assert [frame.stamp_ns for frame in frames] == [7 + n * 50_000_000 for n in range(6)]
    assert {(frame.camera, frame.size_px, frame.layout, frame.row_time_ns) for frame in frames} == {
        ("left", SIZE, "bgr", 0.0)
    }
    assert all(
        np.array_equal(frame.image, picture)
        for frame, picture in zip(frames, pictures, strict=True)
    )


def test_a_video_that_breaks_off_tells_how_far_it_came(tmp_path):
    path = tmp_path / "a.mkv"
    write_video(path, images(40))
    cut(path, 0.5)
    reader = VideoReader("left", path, 20.0)
    reader.open()
    count = 0
    with pytest.raises(
        CaptureError, match=r"a\.mkv: ends after \d+ of 40 frames: cut short or damaged"
    ):
        while reader.read() is not None:
            count += 1
    assert 10 < count < 30


@pytest.mark.parametrize("content", [b"", b"no video at all", b"\x00" * 4096])
def test_what_is_no_video_is_said_to_be_none(tmp_path, content):
    path = tmp_path / "a.mp4"
    path.write_bytes(content)
    with pytest.raises(CaptureError, match=r"a\.mp4: cannot be decoded"):
        read_all(VideoReader("left", path, 20.0))


def test_a_real_mp4_without_its_end_cannot_be_decoded(rhot_data, tmp_path):
    path = tmp_path / "ball.mp4"
    path.write_bytes((rhot_data / "color_video" / "ball2.mp4").read_bytes()[:1_000_000])
    with pytest.raises(CaptureError, match=r"ball\.mp4: cannot be decoded: .* cut short"):
        read_all(VideoReader("left", path, 20.0))


def test_a_missing_video_is_named(tmp_path):
    with pytest.raises(CaptureError, match=r"b\.mp4: no such video file"):
        VideoReader("left", tmp_path / "b.mp4", 20.0).open()


def test_a_capture_has_its_own_stamps(capture):
    frames = read_all(CaptureReader("right", capture))
    assert [frame.stamp_ns for frame in frames] == [
        1_004_000_000 + n * 50_000_000 for n in range(5)
    ]
    assert {frame.row_time_ns for frame in frames} == {33_700.5}
    assert all(
        np.array_equal(frame.image, picture)
        for frame, picture in zip(frames, images(5), strict=True)
    )


def test_cameras_of_a_capture_move_together(capture):
    left = read_all(CaptureReader("left", capture, start_ns=5_000_000_000))
    right = read_all(CaptureReader("right", capture, start_ns=5_000_000_000))
    assert (left[0].stamp_ns, right[0].stamp_ns) == (5_000_000_000, 5_004_000_000)


def test_a_grey_capture_holds_i420(capture):
    pictures = [
        np.random.default_rng(n).integers(0, 256, (72, 64), dtype=np.uint8) for n in range(5)
    ]
    write_video(capture / "left.mkv", pictures)
    frames = read_all(CaptureReader("left", capture))
    assert {(frame.layout, frame.size_px) for frame in frames} == {("i420", SIZE)}
    assert all(
        np.array_equal(frame.image, picture)
        for frame, picture in zip(frames, pictures, strict=True)
    )


@pytest.mark.parametrize(
    ("stamps", "message"),
    [
        (7, r"left\.mkv: ends after 5 of the 7 frames in left\.csv"),
        (3, r"left\.csv: has stamps of 3 frames, but left\.mkv has more"),
        (0, r"left\.csv: has stamps of 0 frames"),
    ],
)
def test_a_capture_whose_parts_differ_is_damaged(capture, stamps, message):
    write_stamps(capture / "left.csv", [FrameStamp(n, n, 0.0) for n in range(stamps)])
    with pytest.raises(CaptureError, match=message):
        read_all(CaptureReader("left", capture))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (
            lambda folder: (folder / "left.csv").write_text(
                "frame,stamp_ns,row_time_ns\n0,zero,1\n"
            ),
            r"left\.csv: line 2: expected three numbers",
        ),
        (lambda folder: (folder / "left.csv").unlink(), r"left\.csv: cannot be read"),
        (
            lambda folder: (folder / "left.mkv").unlink(),
            "has no video of camera 'left'; it has right",
        ),
        (
            lambda folder: cut(folder / "left.mkv", 0.1),
            r"left\.mkv: (cannot be decoded|ends after)",
        ),
    ],
)
def test_what_is_wrong_with_a_capture_is_said(capture, spoil, message):
    spoil(capture)
    with pytest.raises(CaptureError, match=message):
        read_all(CaptureReader("left", capture))


def test_a_missing_capture_is_named(tmp_path):
    with pytest.raises(CaptureError, match="nowhere: no such capture folder"):
        CaptureReader("left", tmp_path / "nowhere").open()


def test_a_folder_is_read_in_the_order_of_its_numbers(tmp_path):
    pictures = images(12)
    for n, picture in enumerate(pictures):
        cv2.imwrite(str(tmp_path / f"shot{n}.png"), picture)
    (tmp_path / "notes.txt").write_text("not an image")
    frames = read_all(FolderReader("left", tmp_path, 10.0, start_ns=3))
    assert [frame.stamp_ns for frame in frames] == [3 + n * 100_000_000 for n in range(12)]
    assert all(
        np.array_equal(frame.image, picture)
        for frame, picture in zip(frames, pictures, strict=True)
    )


def test_a_broken_image_is_named(tmp_path):
    cv2.imwrite(str(tmp_path / "1.png"), images(1)[0])
    (tmp_path / "2.png").write_bytes(b"broken")
    with pytest.raises(CaptureError, match=r"2\.png: cannot be decoded \(image 2 of 2\)"):
        read_all(FolderReader("left", tmp_path, 10.0))


def test_folders_without_images(tmp_path):
    with pytest.raises(CaptureError, match="has no images"):
        FolderReader("left", tmp_path, 10.0).open()
    with pytest.raises(CaptureError, match="no such folder of images"):
        FolderReader("left", tmp_path / "nowhere", 10.0).open()


@pytest.mark.parametrize(("name", "codec"), [("full.avi", "MJPG"), ("limited.mp4", "mp4v")])
def test_videos_of_both_ranges_show_black_white_and_colour_as_they_are(tmp_path, name, codec):
    """Motion JPEG is YUV420 in full range, MPEG-4 in limited range; OpenCV knows which is which."""
    picture = np.zeros((48, 96, 3), np.uint8)
    picture[:, 32:64], picture[:, 64:] = 255, (60, 30, 220)
    writer = cv2.VideoWriter(
        str(tmp_path / name), cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*codec), 20.0, (96, 48)
    )
    for _ in range(2):
        writer.write(picture)
    writer.release()
    frame = read_all(VideoReader("left", tmp_path / name, 20.0))[0]
    black, white, red = (frame.image[24, x].astype(int) for x in (16, 48, 80))
    assert black.max() <= 2
    assert white.min() >= 248
    assert np.abs(red - (60, 30, 220)).max() <= 6
