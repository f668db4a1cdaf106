"""Stamps of videos come from their containers, to a millisecond, whatever their rate does."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from services.pi_tracker.sources.container_size import announced_size
from services.pi_tracker.sources.video import VideoReader
from testing.phone_videos import trim, write_phone_video

FRAMES = 100
# Bits of a frame's number are squares along the upper edge.
BIT_PX = 16


def picture(number):
    image = np.full((64, 8 * BIT_PX, 3), 60, np.uint8)
    for bit in range(8):
        image[:BIT_PX, bit * BIT_PX : (bit + 1) * BIT_PX] = 230 * ((number >> bit) & 1)
    return image


def number_in(image):
    row = image[4:12].mean(axis=(0, 2))
    return sum(
        int(row[bit * BIT_PX + 4 : (bit + 1) * BIT_PX - 4].mean() > 128) << bit for bit in range(8)
    )


def times_of_a_phone():
    """Frames of 1/30 s, some twice as long, some in between."""
    steps = np.random.default_rng(1).choice([1 / 30, 1 / 30, 1 / 24, 1 / 15, 1 / 10], FRAMES - 1)
    return np.concatenate([[0.0], np.cumsum(steps)])


@pytest.fixture(scope="module")
def phone(tmp_path_factory):
    """A video of every container that rhot reads, by its suffix."""
    folder = tmp_path_factory.mktemp("phone")
    for suffix in ("mp4", "mov", "mkv"):
        pictures = (picture(n) for n in range(FRAMES))
        write_phone_video(folder / f"a.{suffix}", pictures, times_of_a_phone())
    return folder


def read(path, **options):
    """Numbers in the pictures and stamps in s, to the end."""
    reader = VideoReader("left", path, 30.0, **options)
    reader.open()
    numbers, stamps_s = [], []
    try:
        while (frame := reader.read()) is not None:
            numbers.append(number_in(frame.image))
            stamps_s.append(frame.stamp_ns * 1e-9)
    finally:
        reader.close()
    return np.array(numbers), np.array(stamps_s)


@pytest.mark.parametrize("suffix", ["mp4", "mov", "mkv"])
def test_a_variable_rate_is_followed_to_a_millisecond(phone, suffix):
    numbers, stamps_s = read(phone / f"a.{suffix}")
    assert numbers.tolist() == list(range(FRAMES))
    assert np.abs(stamps_s - times_of_a_phone()).max() < 1e-3
    # What the average rate would say.
    even = np.linspace(0.0, times_of_a_phone()[-1], FRAMES)
    assert np.abs(even - times_of_a_phone()).max() > 0.05


def test_a_trimmed_video_is_whole(phone, tmp_path):
    trim(phone / "a.mp4", tmp_path / "b.mp4", 2.1)
    numbers, stamps_s = read(tmp_path / "b.mp4")
    times_s = times_of_a_phone()
    shown = np.flatnonzero(times_s >= 2.1)
    assert numbers.tolist() == shown.tolist()
    assert np.abs(stamps_s - (times_s[shown] - times_s[shown[0]])).max() < 1e-3


def test_a_rate_by_hand_takes_the_place_of_the_times(phone):
    _, stamps_s = read(phone / "a.mp4", rate=50.0)
    assert np.allclose(stamps_s, np.arange(FRAMES) / 50.0, atol=1e-9)


@pytest.mark.parametrize("suffix", ["mp4", "mov", "mkv"])
def test_a_container_tells_whether_its_end_is_missing(phone, tmp_path, suffix):
    whole = phone / f"a.{suffix}"
    assert announced_size(whole) == whole.stat().st_size
    for share in (0.3, 0.9, 0.999):
        part = tmp_path / f"part.{suffix}"
        part.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
        assert announced_size(part) > part.stat().st_size


def test_a_variable_rate_video_that_breaks_off_tells_so(phone, tmp_path):
    part = tmp_path / "part.mkv"
    whole = (phone / "a.mkv").read_bytes()
    part.write_bytes(whole[: int(0.6 * len(whole))])
    with pytest.raises(CaptureError, match=r"part\.mkv: ends after \d+ of \d+ frames: cut short"):
        read(part)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"RIFF",
        b"\x1a\x45\xdf\xa3",
        b"\x1a\x45\xdf\xa3\x00",
        b"\x1a\x45\xdf\xa3\xff\xff",
        b"\x00\x00\x00\x01ftyp",
        b"\x00\x00\x00\x00ftyp",
        b"\x00\x00\x00\x02ftypisom",
        bytes(64),
    ],
)
def test_a_broken_head_is_no_endless_loop(tmp_path, content):
    path = tmp_path / "a.bin"
    path.write_bytes(content)
    size = announced_size(path)
    assert size is None or size >= 0
