"""The history of one object: interpolation inside, prediction outside, None where nothing is
known.
"""

from __future__ import annotations

import pytest

from rhot.messages.objects import ObjectPose
from rhot.object_motion import ObjectHistory

MS = 1_000_000
T0 = 10**18


def pose(at_ms: float, **fields) -> ObjectPose:
    """An object that flies along x at 1 m/s and passes 0 at T0."""
    values = {
        "object": "cup",
        "serial": "LHR-1",
        "seq": 0,
        "position_m": (at_ms * 1e-3, 0.0, 0.5),
        "orientation_wxyz": (1.0, 0.0, 0.0, 0.0),
        "velocity_m_s": (1.0, 0.0, 0.0),
        "angular_velocity_rad_s": (0.0, 0.0, 0.0),
        "tracking": "ok",
        "registered": True,
    }
    return ObjectPose(stamp_ns=T0 + round(at_ms * MS), **(values | fields))


def filled(*stamps_ms: float) -> ObjectHistory:
    history = ObjectHistory()
    for at_ms in stamps_ms:
        history.add(pose(at_ms))
    return history


def x_at(history: ObjectHistory, at_ms: float) -> float | None:
    found = history.at(T0 + round(at_ms * MS))
    return None if found is None else found.position_m[0] * 1e3


def test_inside_outside_beyond():
    history = filled(0, 11, 22, 33)
    for at_ms in (0, 5, 11, 21.5, 33, 60, 133):
        assert x_at(history, at_ms) == pytest.approx(at_ms)
    assert x_at(history, -1) is None
    assert x_at(history, 134) is None
    assert ObjectHistory().at(T0) is None


def test_a_gap_is_bridged_up_to_the_horizon_only():
    history = filled(0, 90, 300)
    assert x_at(history, 45) == pytest.approx(45)
    # Carried on from 90 ms for 100 ms, then unknown until the next message.
    assert x_at(history, 150) == pytest.approx(150)
    assert x_at(history, 250) is None


def test_a_lost_object_is_nowhere():
    history = filled(0, 10)
    history.add(pose(20, tracking="lost", position_m=(0.0, 0.0, 0.0)))
    assert x_at(history, 15) == pytest.approx(15)
    assert x_at(history, 20) is None
    assert x_at(history, 25) is None
    assert history.newest is not None
    assert history.newest.tracking == "lost"


def test_two_frames_are_not_mixed():
    history = filled(0, 10)
    history.add(pose(20, registered=False, position_m=(7.0, 0.0, 0.0)))
    middle = history.at(T0 + 15 * MS)
    assert middle is not None
    assert middle.registered
    assert middle.position_m[0] == pytest.approx(0.015)


def test_memory_is_bounded_and_half_a_second_stays():
    for rate_hz in (20, 250, 1000, 10_000):
        history = ObjectHistory()
        for k in range(3 * rate_hz):
            history.add(pose(k * 1e3 / rate_hz))
        assert len(history._poses) <= 1024
        assert x_at(history, 2950) == pytest.approx(2950)
        if rate_hz <= 1000:
            assert x_at(history, 2520) == pytest.approx(2520)


def test_a_clock_set_back_begins_anew():
    history = filled(0, 10, 20)
    history.add(pose(5))
    assert x_at(history, 5) == pytest.approx(5)
    assert x_at(history, 3) is None
