"""Frames of a recording by their numbers."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.errors import CaptureError
from services.cli.recorded.frames import frames_by_number, spread_numbers


@pytest.fixture
def pictures(tmp_path):
    """A folder of five pictures."""
    for seq in range(5):
        cv2.imwrite(str(tmp_path / f"{seq}.png"), np.full((8, 12, 3), 10 * seq, dtype=np.uint8))
    return tmp_path


def test_frames_come_in_the_order_that_is_asked_for(pictures):
    frames = frames_by_number("cam", pictures, [3, 0])
    assert [frame.seq for frame in frames] == [3, 0]
    assert [int(frame.image[0, 0, 0]) for frame in frames] == [30, 0]


def test_a_frame_that_is_not_there_is_named(pictures):
    with pytest.raises(CaptureError, match="has 5 frames, numbered from 0; there is no 7"):
        frames_by_number("cam", pictures, [2, 7])


def test_numbers_are_spread_over_a_recording(pictures):
    assert spread_numbers("cam", pictures, 3) == [0, 2, 4]
