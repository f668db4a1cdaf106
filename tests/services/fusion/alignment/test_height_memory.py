"""The last seconds of each camera's markers."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.alignment.height_memory import MEMORY_S, HeightMemory
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.intake.observations import ObservationBuilder
from testing.synthetic_points import MovingHand, SyntheticRig, frames

RIG = SyntheticRig(clock_error_s=0.0, loss=0.0)
CAMERAS = RIG.rig()
VIEWS = [
    ObservationBuilder(RIG.config(), CAMERAS).build(frame)
    for frame in frames(RIG, MovingHand(), 8.0)
]


def remembered(views) -> HeightMemory:
    memory = HeightMemory(2)
    for view in views:
        memory.add(view)
    return memory


def test_it_holds_the_last_seconds_of_each_landmark():
    memory = remembered(VIEWS)
    assert memory.length_s(0) == pytest.approx(MEMORY_S, abs=0.05)
    first, second = memory.tracks(0, 1, rectified_pairs(tuple(CAMERAS.values()))[0, 1])
    assert len(first) == len(second) == 6
    for one, other in zip(first, second, strict=True):
        assert len(one.times_s) == pytest.approx(30 * MEMORY_S, abs=2)
        assert (np.diff(one.times_s) > 0.0).all()
        # One height, whatever the depth.
        there = np.interp(one.times_s[2:-2], other.times_s, other.heights)
        assert np.abs(one.heights[2:-2] - there).max() < 0.01


def test_a_clock_that_jumps_ends_what_was_before():
    late = [view._replace(instant_ns=view.instant_ns + 10**9) for view in VIEWS]
    memory = remembered([*VIEWS[:240], *late[240:300]])
    assert memory.length_s(0) == pytest.approx(1.0, abs=0.1)
    memory.clear(0)
    assert memory.newest_s(0) is None
    assert memory.length_s(0) == 0.0
    assert memory.length_s(1) > 0.9


def test_frames_without_markers_tell_nothing():
    nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 2)), np.empty(0)
    empty = [
        view._replace(landmarks=nothing[0], delay_s=nothing[1], rays=nothing[2], sigmas=nothing[3])
        for view in VIEWS
    ]
    pair = rectified_pairs(tuple(CAMERAS.values()))[0, 1]
    assert remembered(empty).length_s(0) == pytest.approx(MEMORY_S, abs=0.05)
    assert remembered(empty).tracks(0, 1, pair) == ([], [])
    one_sees = [seen if view.camera else view for view, seen in zip(VIEWS, empty, strict=True)]
    assert remembered(one_sees).tracks(0, 1, pair) == ([], [])
    # Markers come and go, and rays that point backwards have no height.
    late = remembered([*empty[:300], *VIEWS[300:400]])
    assert [len(track.times_s) for track in late.tracks(0, 1, pair)[0]] == [50] * 6
    behind = [view._replace(rays=np.full_like(view.rays, np.nan)) for view in VIEWS]
    assert remembered(behind).tracks(0, 1, pair) == ([], [])


def test_more_markers_than_there_is_room_for_at_first():
    many = [
        view._replace(
            landmarks=np.repeat(view.landmarks, 9),
            delay_s=np.repeat(view.delay_s, 9),
            rays=np.repeat(view.rays, 9, axis=0),
        )
        for view in VIEWS
    ]
    pair = rectified_pairs(tuple(CAMERAS.values()))[0, 1]
    few, more = (remembered(views).tracks(0, 1, pair)[0] for views in (VIEWS, many))
    for one, other in zip(few, more, strict=True):
        assert np.array_equal(np.repeat(one.times_s, 9), other.times_s)
        assert np.array_equal(np.repeat(one.heights, 9), other.heights)
