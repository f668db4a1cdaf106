"""Frames of videos that show the picture before them once more, planted and encoded anew."""

from __future__ import annotations

import re
import shutil

import cv2
import numpy as np
import pytest

from rhot.files.capture import read_lines
from rhot.messages import HandPoints
from services.cli.offline.frames.duplicate_frames import DuplicateFrames
from services.cli.offline.inputs import job_of
from services.cli.offline.run import run
from services.pi_tracker.image.frame import Frame

SIZE = WIDTH, HEIGHT = 320, 240
FRAME_NS = 33_000_000


def picture(x_px: float, noise: np.random.Generator | None = None) -> np.ndarray:
    """A bright disc on grey; noise: of a sensor."""
    image = np.full((HEIGHT, WIDTH, 3), 80, dtype=np.uint8)
    centre = (round(16 * x_px), 16 * 120)
    cv2.circle(image, centre, 16 * 20, (200, 200, 200), -1, cv2.LINE_AA, shift=4)
    if noise is None:
        return image
    return np.clip(image + noise.normal(0.0, 4.0, image.shape), 0, 255).astype(np.uint8)


def left_out(pictures) -> list[int]:
    """The numbers of the pictures that are left out; the others come as they were, in order."""
    frames = [
        Frame("left", n, n * FRAME_NS, 0.0, SIZE, image, "bgr") for n, image in enumerate(pictures)
    ]
    duplicates = DuplicateFrames()
    kept = list(duplicates.new_frames(frames))
    assert [frame.seq for frame in kept] == sorted({frame.seq for frame in kept})
    assert all(frame is frames[frame.seq] for frame in kept)
    assert duplicates.count == len(frames) - len(kept)
    assert bool(duplicates.text("left")) == (duplicates.count > 0)
    return sorted({frame.seq for frame in frames} - {frame.seq for frame in kept})


def at(places, noise=False):
    rng = np.random.default_rng(3) if noise else None
    return [picture(x, rng) for x in places]


@pytest.mark.parametrize("noise", [False, True])
def test_a_picture_that_a_moving_hand_has_once_more(noise):
    pictures = at(np.arange(60.0, 140.0, 2.0), noise)
    pictures[10] = pictures[9]
    pictures[20] = pictures[21] = pictures[19]
    assert left_out(pictures) == [10, 20, 21]


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize("amplitude_px", [0.0, 3.0, 40.0])
@pytest.mark.parametrize("phase", [0.0, 0.1, 0.25, 0.5])
def test_a_hand_that_rests_or_turns_round_is_no_duplicate(noise, amplitude_px, phase):
    n = np.arange(80)
    assert left_out(at(120 + amplitude_px * np.sin(0.45 * (n + phase)), noise)) == []


def test_a_hand_that_stops_in_a_video_without_noise_is_no_duplicate():
    going = np.arange(60.0, 100.0, 3.0)
    stays = np.full(20, going[-1])
    assert left_out(at(np.concatenate([going, stays, going[-1] + going - 57.0]))) == []


def test_a_frozen_picture_lacks_the_noise_of_those_before_it():
    pictures = at(np.arange(60.0, 140.0, 1.0), noise=True)
    pictures[40:70] = [pictures[39]] * 30
    assert left_out(pictures) == list(range(40, 70))


def test_a_still_video_of_noise_keeps_all_and_a_black_one_too():
    assert left_out(at(np.full(40, 120.0), noise=True)) == []
    assert left_out([np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)] * 40) == []


def test_pictures_of_another_size_in_between_are_new_ones():
    pictures = at(np.arange(60.0, 80.0, 2.0))
    pictures.insert(5, np.zeros((100, 100, 3), dtype=np.uint8))
    assert left_out(pictures) == []


def test_a_video_that_was_filled_up_gives_the_points_of_the_pictures_it_has(
    capture, result, tmp_path
):
    """Each camera has every eighth picture twice, and its video is encoded anew."""
    filled = tmp_path / "filled"
    shutil.copytree(capture, filled)
    planted = {name: fill_up(filled / f"{name}.mkv", first) for name, first in camera_firsts()}
    summary = run(job_of([str(filled)], None), tmp_path / "out")
    for name, numbers in planted.items():
        (note,) = [note for note in summary.notes if note.startswith(f"camera {name!r}: ")]
        count, frames = re.findall(r"(\d+) of (\d+) pictures", note)[0]
        # One may be missed, at the beginning or end, where the hand is slow.
        assert len(numbers) - 1 <= int(count) <= len(numbers)
        assert int(frames) == summary.cameras[name].frames + int(count)
    usual = positions(result)
    off_m = [
        float(np.linalg.norm(place - at_the_same_time(usual[name], stamp_ns)))
        for name, places in positions(tmp_path / "out").items()
        for stamp_ns, place in places.items()
    ]
    assert len(off_m) > 200
    assert np.percentile(off_m, 95) < 0.003


def camera_firsts():
    """A camera and the first picture of it that comes twice."""
    return (("left", 5), ("right", 9))


def fill_up(path, first: int) -> list[int]:
    """Every eighth picture of a video from there on is the one before; their numbers."""
    reader = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    size = (
        int(reader.get(cv2.CAP_PROP_FRAME_WIDTH)),
        int(reader.get(cv2.CAP_PROP_FRAME_HEIGHT)),
    )
    made = path.with_suffix(".new.mkv")
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(made), cv2.CAP_FFMPEG, code, 30.0, size)
    last, numbers, count = None, [], 0
    while True:
        ok, image = reader.read()
        if not ok:
            break
        if count >= first and (count - first) % 8 == 0:
            image = last
            numbers.append(count)
        writer.write(image)
        last, count = image, count + 1
    reader.release()
    writer.release()
    made.replace(path)
    return numbers


def positions(folder) -> dict[str, dict[int, np.ndarray]]:
    """By landmark and time."""
    found: dict[str, dict[int, np.ndarray]] = {}
    for points in read_lines(folder / "points.jsonl", HandPoints):
        for point in points.points:
            found.setdefault(point.name, {})[points.stamp_ns] = np.array(point.position_m)
    return found


def at_the_same_time(places, stamp_ns: int) -> np.ndarray:
    """Between the two next in time."""
    xyz = np.array(list(places.values())).T
    return np.array([np.interp(stamp_ns, list(places), one) for one in xyz])
