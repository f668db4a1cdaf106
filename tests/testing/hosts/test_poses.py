"""When poses count as back after a fault."""

from __future__ import annotations

import pytest

from testing.hosts.poses import SeenPose, back_at_s


def poses(*times_s: float, measured: int = 6, error_m: float | None = 0.01) -> list[SeenPose]:
    return [SeenPose(at_s, 0.03, measured, error_m) for at_s in times_s]


def steady(begin_s: float, end_s: float) -> list[SeenPose]:
    return poses(*(begin_s + 0.1 * n for n in range(round((end_s - begin_s) * 10))))


def test_poses_that_were_never_away_are_back_at_the_fault():
    assert back_at_s(steady(10.0, 13.0), 10.0, 13.0, calm_s=2.0) == 10.0


def test_the_end_of_the_last_gap_counts():
    seen = [*steady(10.0, 10.5), *steady(12.0, 12.2), *steady(14.0, 17.0)]
    assert back_at_s(seen, 10.0, 17.0, calm_s=2.0) == pytest.approx(14.0)


def test_they_are_not_back_before_they_have_come_for_a_while():
    assert back_at_s(steady(12.0, 13.0), 10.0, 13.0, calm_s=2.0) is None
    assert back_at_s([], 10.0, 13.0, calm_s=2.0) is None
    # Nor if they have stopped again.
    assert back_at_s(steady(10.0, 13.0), 10.0, 14.0, calm_s=2.0) is None


@pytest.mark.parametrize("bad", [{"measured": 0}, {"error_m": 0.5}])
def test_predicted_and_wrong_poses_do_not_count(bad):
    seen = [*poses(*(10.0 + 0.1 * n for n in range(20)), **bad), *steady(12.0, 15.0)]
    assert back_at_s(seen, 10.0, 15.0, calm_s=2.0) == pytest.approx(12.0)
