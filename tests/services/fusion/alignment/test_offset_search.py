"""Offsets between clocks from heights: found over seconds and minutes, and when it cannot tell."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.alignment.height_rows import rows_of
from services.fusion.alignment.height_track import HeightTrack, interpolated
from services.fusion.alignment.offset_search import fast_length, find_offset
from testing.families.motions import flapping, stop_and_go
from testing.synthetic_points import Motion, MovingHand, RestingHand

FOCAL_PX = 527.0
MOVING = {
    "sinusoids": MovingHand(distance_m=0.6),
    "slow": MovingHand(distance_m=0.6, speed_m_s=0.15, seed=2),
    "stop and go": stop_and_go(14.0, 2),
    "flapping": flapping(1.3, 40.0, 1),
}


def seen(
    motion: Motion, begin_s: float, length_s: float, late_s: float = 0.0, seed: int = 1
) -> list[HeightTrack]:
    """Six landmarks at 30 fps with .06 px of noise, by a clock that is late."""
    random = np.random.default_rng(seed)
    times = np.arange(begin_s, begin_s + length_s, 1.0 / 30.0)
    points = motion(times)  # (n, 6, 3)
    heights = points[:, :, 1] / points[:, :, 2] + random.normal(
        0.0, 0.06 / FOCAL_PX, (len(times), 6)
    )
    return [HeightTrack(times + late_s, heights[:, row]) for row in range(6)]


@pytest.mark.parametrize("motion", MOVING.values(), ids=MOVING)
@pytest.mark.parametrize("late_s", [-2.0, -0.7, -0.02, 0.0, 0.02, 0.137, 2.0])
def test_an_offset_is_found_to_a_millisecond_and_says_how_well(motion, late_s):
    found = find_offset(seen(motion, 0.0, 5.0), seen(motion, 0.016, 5.0, late_s, seed=2))
    assert found.decided, found.why_not
    assert found.offset_s == pytest.approx(late_s, abs=1e-3)
    assert abs(found.offset_s - late_s) < 4.0 * found.sigma_s


def test_one_of_videos_that_were_started_by_hand_is_found_within_a_minute():
    motion = MovingHand(distance_m=0.6, hand_hz=(0.3, 1.9), seed=3)
    first, second = seen(motion, 0.0, 60.0), seen(motion, 17.3, 50.0, -30.0, seed=2)
    assert not find_offset(first, second).decided
    found = find_offset(first, second, range_s=60.0)
    assert found.decided, found.why_not
    assert found.offset_s == pytest.approx(-30.0, abs=5e-4)
    assert find_offset(first, second, range_s=2.0, near_s=-29.0).offset_s == pytest.approx(
        -30.0, abs=5e-4
    )


@pytest.mark.parametrize("seed", range(1, 7))
def test_a_hand_that_rests_tells_what_it_says_it_tells(seed):
    """It wanders by a tenth of a millimetre."""
    rest = RestingHand(distance_m=0.6, seed=seed)
    found = find_offset(seen(rest, 0.0, 5.0), seen(rest, 0.0, 5.0, 0.5, seed=seed + 20))
    assert not found.decided or abs(found.offset_s - 0.5) < 3.5 * found.sigma_s


def test_it_knows_when_it_cannot_tell():
    still = MovingHand(speed_m_s=0.0)
    assert "nothing moves" in find_offset(seen(still, 0.0, 5.0), seen(still, 0.0, 5.0, 0.5)).why_not
    moving, other = MOVING["sinusoids"], MovingHand(distance_m=0.6, seed=9)
    assert not find_offset(seen(moving, 0.0, 5.0), seen(other, 0.0, 5.0)).decided
    assert "overlap" in find_offset(seen(moving, 0.0, 1.0), seen(moving, 0.0, 1.0)).why_not
    assert "no marker" in find_offset([], []).why_not


def test_what_repeats_itself_fits_twice():
    class Swinging:
        def __call__(self, times_s):
            points = MovingHand(distance_m=0.6, speed_m_s=0.0)(times_s)
            points[:, :, 1] += 0.05 * np.sin(2.0 * np.pi * np.asarray(times_s))[:, None]
            return points

    swinging = Swinging()
    found = find_offset(seen(swinging, 0.0, 6.0), seen(swinging, 0.0, 6.0, 0.2, seed=2))
    assert "two offsets fit" in found.why_not
    live = find_offset(
        *(seen(swinging, 0.0, 6.0, late, seed=2) for late in (0.0, 2.2)), together=True
    )
    assert live.offset_s == pytest.approx(2.2, abs=1e-3)


def test_markers_that_are_wrong_for_two_seconds_do_not_move_it():
    motion = MOVING["sinusoids"]
    first, second = seen(motion, 0.0, 6.0), seen(motion, 0.0, 6.0, 0.5, seed=2)
    wrong = [
        track._replace(heights=np.where(track.times_s < 2.5, 0.1, track.heights))
        for track in second
    ]
    found = find_offset(first, wrong)
    assert not found.decided or found.offset_s == pytest.approx(0.5, abs=2e-3)
    one = [*second[:5], second[5]._replace(heights=np.full(len(second[5].heights), 0.1))]
    assert find_offset(first, one).offset_s == pytest.approx(0.5, abs=1e-3)


def test_interpolation_is_exact_on_cubics_and_stops_at_gaps():
    times = np.delete(np.arange(30) / 30.0, slice(12, 18))
    track = HeightTrack(times, times**3 - times)
    at = np.array([0.01, 0.2, 0.5, 0.7, 0.96])
    heights, inside = interpolated(track, at)
    assert inside.tolist() == [False, True, False, True, False]
    np.testing.assert_allclose(heights[inside], (at**3 - at)[inside], atol=1e-12)


def test_transforms_are_of_a_length_that_is_quick():
    assert [fast_length(n) for n in (1200, 1201, 1199, 7)] == [1200, 1215, 1200, 8]


@pytest.mark.parametrize(
    "times",
    [np.zeros(12), np.linspace(1.0, 0.0, 12), np.repeat(np.arange(4.0), 3), np.arange(12.0) // 7.0],
    ids=["none passes", "backwards", "in threes", "in sevens"],
)
def test_stamps_that_stand_still_or_run_back_are_survived(times):
    """The network's, which nobody sorts."""
    odd, usual = (
        HeightTrack(of, np.linspace(0.0, 1.0, 12)) for of in (times, np.arange(12.0) / 30)
    )
    for one, other in ((odd, usual), (usual, odd), (odd, odd)):
        assert not find_offset([one], [other], together=True).decided
        rows = rows_of([(one, other)])
        assert rows is None or np.isfinite(rows.heights.heights).all()
