"""Statistics of made-up errors, checked by definition and in their limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.cli.evaluate.score_statistics import coverage, delay_ms, orientation_error


@given(st.lists(st.integers(-50, 250), max_size=40), st.integers(1, 60))
def test_coverage_is_consistent_for_any_stamps(stamps, expected):
    truth = np.arange(expected, dtype=np.int64) * 10
    found = coverage(np.array(sorted(stamps), dtype=np.int64), truth, 10.0)
    assert 0 <= found.missed <= found.expected == expected
    assert 0 <= found.outside <= len(stamps)
    hits = sum(any(abs(s - t) <= 5 for s in stamps) for t in truth.tolist())
    assert found.missed == expected - hits


def test_turns_are_exact_where_the_dot_product_is_not():
    small = np.array([[1.0, 1e-6, 0.0, 0.0]])
    same = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert orientation_error(small, same).mean_deg == pytest.approx(0.0, abs=1e-3)
    assert orientation_error(np.array([[0.0, 0.0, 1.0, 0.0]]), same).max_deg == pytest.approx(180.0)
    assert orientation_error(-same, same).max_deg == 0.0


def test_a_delay_needs_enough_instants():
    stamps = np.arange(5, dtype=np.int64) * 33_000_000
    values = np.sin(np.arange(5.0))[:, None]
    assert delay_ms(stamps, values, stamps, values) is None
