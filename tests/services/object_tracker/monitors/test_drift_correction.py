"""The correction follows slowly, ends where it should, and never goes far."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from rhot.geometry.transforms import angle_between, apply
from services.object_tracker.monitors.drift_correction import MOST_M, DriftCorrection
from services.object_tracker.monitors.drift_fit import DriftFit


def fit(shift_m: tuple[float, float, float], turn_deg: float = 0.0) -> DriftFit:
    turn = np.deg2rad(turn_deg) * np.array([0.0, 1.0, 0.0])
    return DriftFit(np.array(shift_m), turn, np.array([0.1, 0.0, 0.6]), np.eye(6), 0.5, 9.0)


def test_it_reaches_what_is_wanted_at_two_millimetres_a_second_and_returns() -> None:
    correction, wanted = DriftCorrection(), fit((0.006, 0.0, 0.008), turn_deg=0.3)
    assert correction.want(wanted)
    path = [correction.T_rig_from_before]
    for _ in range(12):
        correction.follow(1.0)
        path.append(correction.T_rig_from_before)
    assert path[-1] == pytest.approx(wanted.T_rig_from_before, abs=1e-9)
    for before, after in pairwise(path):
        moved = apply(after, wanted.middle_m) - apply(before, wanted.middle_m)
        assert np.linalg.norm(moved) < 0.0021
        assert angle_between(before[:3, :3], after[:3, :3]) < np.deg2rad(0.101)
    assert correction.distance_m == pytest.approx(0.01, abs=1e-6)
    assert correction.want(None)
    for _ in range(12):
        correction.follow(1.0)
    assert correction.T_rig_from_before == pytest.approx(np.eye(4), abs=1e-9)


def test_what_is_too_far_is_not_followed() -> None:
    correction = DriftCorrection()
    assert not correction.want(fit((MOST_M + 0.001, 0.0, 0.0)))
    assert not correction.want(fit((0.0, 0.0, 0.0), turn_deg=2.1))
    correction.follow(1.0)
    assert correction.distance_m == pytest.approx(0.0, abs=1e-12)
