"""A bumped camera: reported when it shows for long, taken back when the views fit again."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.monitors.moved_camera import MOVED_PX, MovedCameraMonitor


class Watched:
    """A monitor of two pairs, of which the first is shown heights ten times a second."""

    def __init__(self) -> None:
        self.monitor = MovedCameraMonitor(2, 6)
        self.time_s = 0.0

    def show(self, heights_px: Array, seconds: float = 2.0) -> list[float | None]:
        """Heights (n, 6) of six landmarks, the same again and again; what is told after each."""
        told = []
        for k in range(round(10 * seconds)):
            self.time_s += 0.1
            row = heights_px[k % len(heights_px)]
            self.monitor.observe(0, self.time_s, np.arange(len(row)), row)
            told.append(self.monitor.height_px(0))
        return told


def constant(px: float) -> Array:
    return np.full((1, 6), px)


def test_heights_that_differ_for_seconds_are_reported_with_their_size():
    watched = Watched()
    assert watched.show(constant(-4.0), 0.8) == [None] * 8
    assert watched.show(constant(-4.0), 2.0)[-1] == pytest.approx(4.0)
    assert watched.monitor.height_px(1) is None


def test_a_roll_that_moves_four_landmarks_in_six_is():
    assert Watched().show(np.array([[5.0, 3.0, 0.4, -0.3, -3.0, -5.0]]))[-1] == pytest.approx(4.0)


def test_a_landmark_that_is_wrong_for_long_is_not():
    assert Watched().show(np.array([[0.2, 50.0, 0.1, 0.2, -0.1, 40.0]]), 10.0) == [None] * 100


def test_errors_that_last_for_some_frames_are_not():
    """3 px in each camera, correlated by .34 at ten a second and by .7 between neighbours."""
    random = np.random.default_rng(1)
    together = np.linalg.cholesky(0.7 ** np.abs(np.subtract.outer(np.arange(6), np.arange(6))))
    errors = np.zeros((600, 6))
    for k in range(1, 600):
        white = together @ random.normal(0.0, np.sqrt(2.0) * 3.0, 6)
        errors[k] = 0.34 * errors[k - 1] + np.sqrt(1.0 - 0.34**2) * white
    assert Watched().show(errors, 60.0) == [None] * 600


def test_one_picture_that_is_frozen_while_the_hand_moves_is_not():
    sway = 60.0 * np.sin(2.0 * np.pi * 0.8 * 0.1 * np.arange(100))
    assert Watched().show(20.0 + sway[:, None] * np.ones(6), 10.0) == [None] * 100


def test_it_is_taken_back_when_most_heights_fit_again():
    watched = Watched()
    assert watched.show(constant(2.0 * MOVED_PX))[-1] is not None
    # A third that do not fit would not be reported, but what is reported stays.
    third = np.array([[3.0, 3.0, 0.1, 0.1, 0.1, 0.1]])
    assert None not in watched.show(third * MOVED_PX, 5.0)
    assert watched.show(constant(0.1), 0.5)[-1] is None


def test_an_infinite_height_counts_as_one_that_does_not_fit():
    assert Watched().show(constant(np.inf))[-1] == pytest.approx(1e3)


def test_what_was_before_time_went_back_does_not_count():
    watched = Watched()
    assert watched.show(constant(4.0))[-1] is not None
    watched.time_s = 0.0
    assert watched.show(constant(0.1), 1.2)[-1] is None


def test_heights_that_come_more_often_than_there_is_room_for():
    monitor = MovedCameraMonitor(1, 1)
    for k in range(500):
        monitor.observe(0, 0.01 * k, np.zeros(1, dtype=np.int64), np.full(1, 0.1 * k))
    assert monitor.height_px(0) == pytest.approx(48.0, abs=0.2)
