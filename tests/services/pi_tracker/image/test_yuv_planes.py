"""Both layouts give the same luma and chroma."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.errors import SourceError
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import bgr_image, picture


def frame_of(image, size_px, layout):
    return Frame("left", 7, 0, 0.0, size_px, image, layout)


def test_bgr_and_i420_agree(studio, tip):
    clean, _ = studio.clean([tip("blue", 30.0, 32.0)])
    bgr = studio.bgr(clean, 4.0, 1)
    rect = (5, 6, 25, 28)
    planar, packed = picture(studio.of(bgr, layout="i420")), picture(studio.of(bgr, layout="bgr"))
    for a, b in zip(planar.cells(rect), packed.cells(rect), strict=True):
        assert a.shape == b.shape
        assert np.abs(a.astype(int) - b.astype(int)).max() <= 1
    for image in (planar, packed):
        for every, third in zip(image.cells(rect), image.cells(rect, 3), strict=True):
            assert np.array_equal(every[::3], third)
    buffers = [(np.zeros((44, 40), np.uint8), np.zeros((2, 22, 20), np.uint8)) for _ in range(2)]
    for image, (luma, chroma) in zip((planar, packed), buffers, strict=True):
        image.copy_to(rect, luma, chroma)
    assert np.abs(buffers[0][0].astype(int) - buffers[1][0]).max() <= 1
    assert np.abs(buffers[0][1].astype(int) - buffers[1][1]).max() <= 1


def test_full_range_means_the_same_as_limited_range(studio, tip):
    """Black, white and every paint; to one level, the rounding of both."""
    clean, _ = studio.clean([tip("blue", 30.0, 32.0), tip("magenta", 50.0, 20.0)])
    clean[:8, :8], clean[:8, 8:16] = 0.0, 255.0
    bgr = studio.bgr(clean, 0.0, 1)
    limited, full = (studio.of(bgr, full_range=wide) for wide in (False, True))
    assert (full.image[:8, :8].max(), full.image[:8, 8:16].min()) == (0, 255)
    rect = (0, 0, 32, 32)
    for a, b in zip(picture(limited).cells(rect), picture(full).cells(rect), strict=True):
        assert np.abs(a.astype(int) - b.astype(int)).max() <= 1
    copies = []
    for frame in (limited, full):
        luma, chroma = np.zeros((64, 64), np.uint8), np.zeros((2, 32, 32), np.uint8)
        picture(frame).copy_to(rect, luma, chroma)
        copies.append((luma.astype(int), chroma.astype(int)))
    assert np.abs(copies[0][0] - copies[1][0]).max() <= 1
    assert np.abs(copies[0][1] - copies[1][1]).max() <= 1
    # What people see: chroma has a quarter of the pixels, so compare what both ranges show.
    difference = bgr_image(limited).astype(int) - bgr_image(full).astype(int)
    assert np.abs(difference).max() <= 4
    assert abs(difference.mean()) < 0.3
    hsv = [cv2.cvtColor(bgr_image(frame), cv2.COLOR_BGR2HSV) for frame in (limited, full)]
    assert tuple(hsv[1][2, 12]) == (0, 0, 255)
    assert abs(int(hsv[0][32, 30, 0]) - int(hsv[1][32, 30, 0])) <= 1


def test_chroma_is_averaged_not_sampled():
    bgr = np.zeros((4, 4, 3), np.uint8)
    bgr[::2, ::2] = (255, 0, 0)
    _, chroma = picture(frame_of(bgr, (4, 4), "bgr")).cells((0, 0, 2, 2))
    # A quarter of full blue: U is 128 + 112 / 4.
    assert np.all(np.abs(chroma[..., 0].astype(int) - 156) <= 1)


def test_an_odd_row_and_column_are_left_out():
    assert picture(frame_of(np.zeros((481, 641, 3), np.uint8), (641, 481), "bgr")).size == (
        320,
        240,
    )


@pytest.mark.parametrize(
    ("image", "size_px", "layout"),
    [
        (np.zeros((480, 640, 3), np.uint8), (320, 240), "bgr"),
        (np.zeros((480, 640), np.uint8), (640, 480), "i420"),
        (np.zeros((480, 640, 3), np.float32), (640, 480), "bgr"),
        (np.zeros((1, 640, 3), np.uint8), (640, 1), "bgr"),
        (np.zeros((7, 5), np.uint8), (5, 5), "i420"),
    ],
)
def test_an_image_that_is_not_what_its_frame_says_is_refused(image, size_px, layout):
    with pytest.raises(SourceError, match="camera 'left': "):
        picture(frame_of(image, size_px, layout))
