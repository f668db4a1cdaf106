"""Identical pictures are told by all of their pixels."""

from __future__ import annotations

from dataclasses import replace

import pytest

from services.pi_tracker.monitors.repeated_picture import RepeatedPicture


@pytest.mark.parametrize("layout", ["i420", "bgr"])
def test_one_pixel_makes_another_picture(studio, tip, layout):
    frame, _ = studio.frame([tip("green", 20.0, 20.0)], layout=layout)
    watch = RepeatedPicture()
    assert not watch.update(frame, 0)
    assert watch.update(replace(frame, seq=1, image=frame.image.copy()), 1)
    other = frame.image.copy()
    other[3, 5] ^= 1
    assert not watch.update(replace(frame, seq=2, image=other), 2)
    assert watch.repeated == 1


def test_a_picture_of_another_size_is_another(studio):
    watch = RepeatedPicture()
    watch.update(studio.frame([])[0], 0)
    assert not watch.update(studio.frame([], size_px=(96, 96))[0], 1)


def test_frozen_begins_after_a_second_and_ends_with_the_next_picture(studio):
    frame, _ = studio.frame([])
    watch = RepeatedPicture()
    for now_ns in range(0, 1_400_000_000, 100_000_000):
        watch.update(frame, now_ns)
        assert (watch.frozen_s(now_ns) > 0.0) == (now_ns >= 1_100_000_000)
    watch.update(studio.frame([], seq=1)[0], 1_500_000_000)
    assert watch.frozen_s(1_500_000_000) == 0.0
