"""When simulated cameras expose their frames, and the errors of their clocks."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.rig_tables import CameraTable
from services.simulator.camera_clock import CameraClock, camera_clock


def pair(seed: int = 1, fps: float = 30.0) -> tuple[CameraClock, CameraClock]:
    left, right = (CameraTable(name=name, fps=fps) for name in ("left", "right"))
    return camera_clock(left, 0, 2, 0.008, seed), camera_clock(right, 1, 2, 0.008, seed)


@pytest.mark.parametrize("fps", [30.0, 60.0, 90.0])
def test_cameras_run_free_and_half_a_period_apart(fps):
    left, right = pair(fps=fps)
    apart_s = abs(left.phase_s - right.phase_s)
    assert apart_s == pytest.approx(0.5 / fps, abs=0.04 / fps)
    for clock in (left, right):
        assert abs(clock.period_s * fps - 1.0) < 21e-6
        assert np.diff([clock.time_s(k) for k in range(5)]) == pytest.approx(clock.period_s)
        # A row is read and exposed within the period.
        assert clock.row_time_ns * 1e-9 * 480 < 0.9 * clock.period_s
        assert clock.exposure_s <= 0.9 * clock.period_s
    assert left.period_s != right.period_s


def test_row_times_are_those_of_real_sensors():
    assert all(25e3 < clock.row_time_ns < 35e3 for clock in pair())


def test_clocks_are_off_and_drift_within_bounds():
    skews = np.array([[pair(seed)[0].skew_ns(t) for t in (0.0, 100.0)] for seed in range(40)])
    assert np.all(np.abs(skews[:, 0]) <= 20e6)
    assert np.all(np.abs(skews[:, 1] - skews[:, 0]) <= 50e-6 * 100e9 + 1)
    assert np.std(skews[:, 0]) > 5e6


def test_recordings_keep_a_small_residual():
    for seed in range(40):
        for clock in pair(seed):
            assert all(abs(clock.residual_at_ns(t)) <= 0.5e6 for t in (0.0, 60.0))


def test_some_frames_get_lost_and_always_the_same():
    clock, other = pair()
    lost = [k for k in range(6_000) if clock.dropped(k)]
    assert 0.01 <= len(lost) / 6_000 <= 0.02
    assert lost == [k for k in range(6_000) if clock.dropped(k)]
    assert lost != [k for k in range(6_000) if other.dropped(k)]


def test_stamps_jitter_by_microseconds():
    clock = pair()[0]
    errors = [clock.stamp_error_ns(k) for k in range(1000)]
    assert np.std(errors) == pytest.approx(20e3, rel=0.1)
    assert errors == [clock.stamp_error_ns(k) for k in range(1000)]


def test_first_frame_is_the_next_one():
    clock = pair()[0]
    for t_s in (0.0, 0.5, clock.time_s(7), clock.time_s(7) + 1e-6):
        first = clock.first_frame(t_s)
        assert clock.time_s(first) >= t_s - 1e-9
        assert first == 0 or clock.time_s(first - 1) < t_s
