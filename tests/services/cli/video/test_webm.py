"""The video's file: whole under its name, or not there; failed writes are one error."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.errors import CaptureError
from services.cli.video.webm import WebmWriter

SIZE_PX = (64, 48)


def picture(value: int) -> np.ndarray:
    return np.full((48, 64, 3), value, np.uint8)


def test_a_video_is_whole_and_silent(tmp_path, capfd):
    path = tmp_path / "a.webm"
    with WebmWriter(path, SIZE_PX, 25.0) as video:
        for value in range(50):
            video.write(picture(4 * value))
        assert not path.exists()
    read = cv2.VideoCapture(str(path))
    assert read.get(cv2.CAP_PROP_FPS) == pytest.approx(25.0)
    values = [round(read.read()[1].mean()) for _ in range(50)]
    assert np.allclose(values, 4 * np.arange(50), atol=4)
    assert not read.read()[0]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_a_run_that_ends_early_leaves_what_was_there(tmp_path, error):
    path = tmp_path / "a.webm"
    path.write_bytes(b"of before")
    with pytest.raises(error), WebmWriter(path, SIZE_PX, 25.0) as video:
        video.write(picture(1))
        raise error
    assert [one.name for one in tmp_path.iterdir()] == ["a.webm"]
    assert path.read_bytes() == b"of before"


def test_a_file_that_may_not_grow_is_one_error(tmp_path, small_files, capfd):
    """OpenCV tells nobody that it could not write."""
    noise = np.random.default_rng(1).integers(0, 255, (20, 240, 320, 3), dtype=np.uint8)
    with (
        pytest.raises(CaptureError, match=r"a\.webm: the video cannot be written; the disk"),
        WebmWriter(tmp_path / "a.webm", (320, 240), 25.0) as video,
    ):
        for one in noise:
            video.write(one)
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr().err == ""


def test_a_folder_that_takes_no_file(tmp_path):
    with (
        pytest.raises(CaptureError, match="the video cannot be written"),
        WebmWriter(tmp_path / "gone" / "a.webm", SIZE_PX, 25.0),
    ):
        pass
