"""The output schedule: when points are due."""

from __future__ import annotations

import numpy as np

from services.fusion.output.schedule import OutputSchedule

FRAME_NS = 33_333_333


def drive(schedule: OutputSchedule, frames) -> list[int]:
    return [due for camera, instant in frames for due in schedule.add_frame(camera, instant)]


def both(frames: int, *, lost=(), phase_ns: int = FRAME_NS // 2):
    events = [(0, k * FRAME_NS) for k in range(frames) if k not in lost] + [
        (1, k * FRAME_NS + phase_ns) for k in range(frames)
    ]
    return sorted(events, key=lambda event: event[1])


def test_one_instant_for_each_frame_of_the_reference():
    assert drive(OutputSchedule([1 / 30, 1 / 30], 0), both(10)) == [k * FRAME_NS for k in range(10)]


def test_lag_waits_and_the_rest_is_told_at_the_end():
    schedule = OutputSchedule([1 / 30, 1 / 30], 2)
    assert drive(schedule, both(10)) == [k * FRAME_NS for k in range(8)]
    assert schedule.take_waiting() == [8 * FRAME_NS, 9 * FRAME_NS]
    assert schedule.take_waiting() == []


def test_the_other_camera_carries_on_where_the_reference_stops():
    due = drive(OutputSchedule([1 / 30, 1 / 30], 0), both(100, lost=range(20, 60)))
    assert len(due) >= 99
    assert np.diff(due).max() <= 1.6 * FRAME_NS


def test_a_lost_frame_costs_no_instant():
    due = drive(OutputSchedule([1 / 30, 1 / 30], 0), both(100, lost=(20, 40, 60)))
    assert 97 <= len(due) <= 101
    assert np.diff(due).max() <= 1.6 * FRAME_NS


def test_the_fastest_camera_leads_as_soon_as_it_is_there():
    schedule = OutputSchedule([1 / 30, 1 / 90], 0)
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
        OutputSchedule([1 / 30, 1 / 30, 1 / 60], 1),
        zip(
            random.integers(0, 3, 500).tolist(),
            random.integers(0, 10**10, 500).tolist(),
            strict=True,
        ),
    )
    assert due == sorted(set(due))


def test_the_camera_that_sees_soonest_after_the_other_leads():
    """4 ms apart: at the earlier one's frames what the other saw is 29 ms old."""
    late_ns = 4_000_000
    due = np.array(drive(OutputSchedule([1 / 30, 1 / 30], 0), both(60, phase_ns=late_ns)))
    settled = due[due > 3 * FRAME_NS]
    assert set((settled % FRAME_NS).tolist()) == {late_ns}
    assert np.diff(due).max() <= 1.5 * FRAME_NS
    assert len(due) >= 59


def test_cameras_that_drift_past_each_other_change_the_lead_once_a_round():
    slower_ns = round(FRAME_NS * 1.002)
    frames = 1500
    events = sorted(
        [(0, k * FRAME_NS) for k in range(frames)] + [(1, k * slower_ns) for k in range(frames)],
        key=lambda event: event[1],
    )[: 2 * frames - 10]
    schedule = OutputSchedule([1 / 30, 1 / 30], 0)
    newest, leaders, ages_ns = {0: 0, 1: 0}, [], []
    for camera, instant_ns in events:
        newest[camera] = instant_ns
        for due_ns in schedule.add_frame(camera, instant_ns):
            leaders.append(due_ns % FRAME_NS == 0)
            ages_ns.append(due_ns - min(newest.values()))
    # Each third round of 500 frames: one change to the other and one back.
    assert 4 <= np.count_nonzero(np.diff(leaders)) <= 7
    assert len(leaders) >= 0.99 * frames
    # But for some frames after each pass, until the change is sure.
    assert np.percentile(ages_ns, 98.0) <= 0.7 * FRAME_NS


def test_a_camera_that_fell_silent_is_not_waited_for():
    soon = both(100, phase_ns=4_000_000)
    events = [event for event in soon if event[0] == 0 or event[1] < 40 * FRAME_NS]
    due = drive(OutputSchedule([1 / 30, 1 / 30], 0), events)
    assert np.diff(due).max() <= 2.0 * FRAME_NS
    assert due[-1] == 99 * FRAME_NS


def test_cameras_that_expose_together_are_told_of_once_both_have_come():
    """Whose frame comes first is chance, and one of each thirtieth is lost."""
    random, schedule = np.random.default_rng(3), OutputSchedule([1 / 30, 1 / 30], 0)
    told, waits = [], []
    for k in range(300):
        instants = {0: k * FRAME_NS, 1: k * FRAME_NS + 100_000}
        for camera in random.permutation(2).tolist():
            if random.random() < 1.0 / 30.0:
                continue
            due = schedule.add_frame(camera, instants[camera])
            told += due
            waits += [k - round(instant / FRAME_NS) for instant in due]
    assert len(told) >= 0.96 * 300
    assert told == sorted(set(told))
    assert set(waits) <= {0, 1}
    # One that waited for a lost frame is told with the next.
    assert np.mean(waits) < 0.06


def test_a_lost_frame_of_the_camera_that_leads_costs_no_instant():
    """4 ms after the other: the other's next frame stands in, and the lead stays."""
    late_ns = 4_000_000
    lost = {20, 40, 60}
    events = [
        event
        for event in both(100, phase_ns=late_ns)
        if event[0] == 0 or event[1] // FRAME_NS not in lost
    ]
    due = np.array(drive(OutputSchedule([1 / 30, 1 / 30], 0), events))
    assert len(due) >= 99
    assert np.diff(due).max() <= 2.0 * FRAME_NS
    assert np.count_nonzero(due[5:] % FRAME_NS == 0) == len(lost)
