"""The output schedule: when points are due."""

from __future__ import annotations

import numpy as np

from services.fusion.output.schedule import OutputSchedule

FRAME_NS = 33_333_333


def drive(schedule: OutputSchedule, frames) -> list[int]:
    return [
        due
        for camera, instant in frames
        if (due := schedule.add_frame(camera, instant)) is not None
    ]


def both(frames: int, *, lost=(), phase_ns: int = FRAME_NS // 2):
    events = [(0, k * FRAME_NS) for k in range(frames) if k not in lost] + [
        (1, k * FRAME_NS + phase_ns) for k in range(frames)
    ]
    return sorted(events, key=lambda event: event[1])


def test_one_instant_for_each_frame_of_the_reference():
    assert drive(OutputSchedule(np.array([30.0, 30.0]), 0), both(10)) == [
        k * FRAME_NS for k in range(10)
    ]


def test_lag_waits_and_the_rest_is_told_at_the_end():
    schedule = OutputSchedule(np.array([30.0, 30.0]), 2)
    assert drive(schedule, both(10)) == [k * FRAME_NS for k in range(8)]
    assert schedule.take_waiting() == [8 * FRAME_NS, 9 * FRAME_NS]
    assert schedule.take_waiting() == []


def test_the_other_camera_carries_on_where_the_reference_stops():
    due = drive(OutputSchedule(np.array([30.0, 30.0]), 0), both(100, lost=range(20, 60)))
    assert len(due) >= 99
    assert np.diff(due).max() <= 1.6 * FRAME_NS


def test_a_lost_frame_costs_no_instant():
    due = drive(OutputSchedule(np.array([30.0, 30.0]), 0), both(100, lost=(20, 40, 60)))
    assert 97 <= len(due) <= 101
    assert np.diff(due).max() <= 1.6 * FRAME_NS


def test_the_fastest_camera_leads_as_soon_as_it_is_there():
    schedule = OutputSchedule(np.array([30.0, 90.0]), 0)
    slow = [(0, k * FRAME_NS) for k in range(10)]
    fast = [(1, 10 * FRAME_NS + k * FRAME_NS // 3) for k in range(30)]
    assert len(drive(schedule, slow)) == 10
    assert (
        len(
            drive(
                schedule,
                [
                    event
                    for pair in zip(fast, [(0, f[1] + 1) for f in fast], strict=True)
                    for event in pair
                ],
            )
        )
        == 30
    )


def test_instants_ascend_whatever_comes():
    random = np.random.default_rng(0)
    due = drive(
        OutputSchedule(np.array([30.0, 30.0, 60.0]), 1),
        zip(
            random.integers(0, 3, 500).tolist(),
            random.integers(0, 10**10, 500).tolist(),
            strict=True,
        ),
    )
    assert due == sorted(set(due))
