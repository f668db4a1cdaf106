"""Who leaves a band: a stiff joint, and hardly a healthy newcomer."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.compare.band import (
    band_of,
    curve_band,
    curve_leavings,
    judged,
)
from studies.grasp.compare.paths import tip_path
from testing.synthetic_fingers import Motion, Person, recorded_person

FRAMES = np.linspace(0.0, 1.0, 30)


def path(width: float, depth: float) -> np.ndarray:
    """An arc from straight ahead to the palm."""
    turn = FRAMES * np.deg2rad(100.0 + 30.0 * width)
    size = 1.0 - (0.35 + 0.05 * depth) * FRAMES
    return np.column_stack([np.cos(turn), np.sin(turn)]) * size[:, None]


def test_newcomers_of_the_same_kind_stay_inside_about_as_often_as_told():
    rng = np.random.default_rng(5)
    outside = 0
    for _ in range(12):
        band = band_of([path(*rng.normal(size=2)) for _ in range(5)])
        outside += bool(judged(path(*rng.normal(size=2)), band).leavings)
    # One in six is expected: 2 of 12.
    assert outside <= 5


def test_a_stiff_joint_leaves_it_and_where(paths):
    band = band_of([one.path for one in paths])
    stiff = Person("stiff", (41.0, 24.0, 19.0), (0.0, 2.0 / 3.0, 0.0), (80.0, 55.0))
    found = judged(tip_path("stiff", recorded_person(stiff, Motion(cycles=1, fps=30.0))).path, band)
    assert len(found.leavings) == 1
    (leaving,) = found.leavings
    assert leaving.start < 0.6
    assert leaving.end == pytest.approx(1.0)
    # It stays away from the palm's side of the knuckle: outside of the mean arc.
    assert leaving.furthest > 0.15
    assert leaving.widths > 1.2
    healthy = Person("new", (43.0, 24.0, 20.0), (0.02, 0.62, 0.0), (81.0, 100.0))
    other = tip_path("new", recorded_person(healthy, Motion(cycles=1, fps=30.0)))
    assert judged(other.path, band).leavings == []


def test_curves_have_a_band_too():
    rng = np.random.default_rng(1)
    curves = [100.0 * FRAMES + 5.0 * rng.normal() * FRAMES for _ in range(6)]
    band = curve_band(curves, 2.0)
    # The floor, widened with the rest.
    assert 2.0 <= band.half_width[0] < 6.0
    assert band.half_width[-1] > 10.0
    assert curve_leavings(curves[0], band) == []
    (late,) = curve_leavings(60.0 * FRAMES, band)
    assert late.furthest < -30.0


def test_too_few_references():
    with pytest.raises(CaptureError, match="a band needs 3 people at least"):
        band_of([path(0.0, 0.0), path(1.0, 0.0)])
    assert band_of([path(0.0, 0.0), path(1.0, 0.0), path(0.0, 1.0)]).references == 3
