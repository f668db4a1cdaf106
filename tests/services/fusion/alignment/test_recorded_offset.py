"""Offset and drift of whole recordings: found to a millisecond with an honest sigma, or refused."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.alignment.height_track import HeightTrack
from services.fusion.alignment.recorded_offset import find_recorded_offset
from testing.families.motions import stop_and_go
from testing.synthetic_points import Motion, MovingHand

FOCAL_PX = 527.0
MOTIONS = {
    "sinusoids": MovingHand(distance_m=0.6, hand_hz=(0.3, 1.9), seed=3),
    "stop and go": stop_and_go(14.0, 2),
}


def seen(
    motion: Motion,
    begin_s: float,
    length_s: float,
    fps: float,
    late: tuple[float, float],
    seed: int,
) -> list[HeightTrack]:
    """Six landmarks with .06 px of noise, by a clock that is late by an offset and a drift."""
    random = np.random.default_rng(seed)
    times = begin_s + np.arange(0.0, length_s, 1.0 / fps)
    # As of a phone: a variable rate, and frames that are lost.
    times = np.sort(times + random.uniform(-2e-3, 2e-3, len(times)))
    times = times[random.random(len(times)) > 0.05]
    points = motion(times)  # (n, 6, 3)
    heights = points[:, :, 1] / points[:, :, 2]
    heights += random.normal(0.0, 0.06 / FOCAL_PX, heights.shape)
    return [HeightTrack(late[0] + times * (1.0 + late[1]), heights[:, row]) for row in range(6)]


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
@pytest.mark.parametrize(
    ("offset_s", "drift"),
    [(-7.3, 1e-4), (-0.5, 0.0), (-0.02, -2e-4), (0.0, 0.0), (0.137, 5e-5), (30.0, 0.0)],
)
def test_offset_and_drift_are_found(motion, offset_s, drift):
    length_s = 11.0
    # Two rates, and only a part is seen by both.
    first = seen(motion, 0.0, length_s, 30.0, (0.0, 0.0), 1)
    second = seen(motion, 2.0, length_s, 50.0, (offset_s, drift), 2)
    found = find_recorded_offset(first, second)
    assert found.decided, found.why_not
    line = found.fit.line
    error_s = line.offset_s - (offset_s + drift * line.at_s)
    assert abs(error_s) < 1e-3
    assert abs(error_s) < 4.0 * found.fit.offset_sigma_s
    assert abs(line.drift - drift) < 4.0 * found.fit.drift_sigma
    assert 0.05 < found.residual * FOCAL_PX < 0.25


def test_drift_is_told_by_a_longer_recording():
    motion = MOTIONS["sinusoids"]
    first = seen(motion, 0.0, 150.0, 20.0, (0.0, 0.0), 1)
    second = seen(motion, 25.0, 150.0, 20.0, (-30.0, 2e-4), 2)
    found = find_recorded_offset(first, second)
    assert found.decided, found.why_not
    assert found.fit.line.late_s(0.0) == pytest.approx(-30.0, abs=1e-3)
    assert found.fit.line.drift == pytest.approx(2e-4, abs=1e-5)
    assert found.fit.drift_sigma < 1e-5


def test_a_hand_that_waves_evenly_fits_twice_and_says_so():
    class Waving:
        def __call__(self, times_s):
            points = MovingHand(distance_m=0.6, speed_m_s=0.0)(times_s)
            points[:, :, 1] += 0.05 * np.sin(2.0 * np.pi * np.asarray(times_s))[:, None]
            return points

    found = find_recorded_offset(
        seen(Waving(), 0.0, 12.0, 30.0, (0.0, 0.0), 1),
        seen(Waving(), 0.0, 12.0, 30.0, (0.2, 0.0), 2),
    )
    assert "two offsets fit" in found.why_not
    # The best and the second best are whole periods apart.
    periods = found.second_s - found.fit.line.offset_s
    assert periods == pytest.approx(round(periods), abs=0.01)
    assert found.second_residual == pytest.approx(found.residual, rel=0.3)


def test_it_says_why_it_cannot_tell():
    still, moving = MovingHand(speed_m_s=0.0), MOTIONS["sinusoids"]
    first = seen(still, 0.0, 8.0, 30.0, (0.0, 0.0), 1)
    assert "nothing moves" in find_recorded_offset(first, first).why_not
    other = seen(MovingHand(distance_m=0.6, seed=9), 0.0, 8.0, 30.0, (0.0, 0.0), 2)
    assert not find_recorded_offset(seen(moving, 0.0, 8.0, 30.0, (0.0, 0.0), 1), other).decided
    assert "no marker" in find_recorded_offset([], []).why_not
