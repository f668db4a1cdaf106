"""Means and spreads over cycles and people."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.cycles.spread import spread, spread_over_people


def test_unmeasured_points_are_left_out():
    found = spread([np.array([1.0, 2.0]), np.array([3.0, np.nan])])
    assert found.mean == pytest.approx([2.0, 2.0])
    assert found.sd[0] == pytest.approx(np.sqrt(2.0))
    assert np.isnan(found.sd[1])
    assert found.known.tolist() == [2, 1]


def test_a_person_with_more_cycles_counts_as_one():
    rng = np.random.default_rng(2)
    centres = rng.normal(50.0, 8.0, 400)
    people = [list(rng.normal(one, 2.0, (2 + k % 9, 1))) for k, one in enumerate(centres)]
    found = spread_over_people(people)
    assert found.mean[0] == pytest.approx(50.0, abs=1.5)
    assert found.between_sd[0] == pytest.approx(8.0, abs=1.0)
    assert found.within_sd[0] == pytest.approx(2.0, abs=0.2)
    assert np.isnan(spread_over_people([[np.array([1.0])]]).within_sd[0])
