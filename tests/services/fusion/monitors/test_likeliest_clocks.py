"""Clocks of several cameras from the differences of pairs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from services.fusion.monitors.likeliest_clocks import likeliest_clocks

BOUNDS_S = np.full(3, 0.01)


def test_surer_clocks_move_less():
    told = np.array([[0.0, 1.0, 0.002, 1e-12, 1.0]])
    late_s, cov = likeliest_clocks(told, np.array([1e-4, 2e-3]), BOUNDS_S[:2])
    assert late_s[1] - late_s[0] == pytest.approx(0.002, rel=1e-3)
    assert abs(late_s[1]) > 100.0 * abs(late_s[0])
    # Their difference is known well, and what they share as well as the surer one.
    assert cov[0, 0] + cov[1, 1] - 2.0 * cov[0, 1] == pytest.approx(1e-12, rel=1e-2)


def test_pairs_agree_on_three_clocks():
    true_s = np.array([0.0, 0.003, -0.002])
    told = np.array(
        [[a, b, true_s[b] - true_s[a], 1e-10, 1.0] for a, b in ((0, 1), (0, 2), (1, 2))]
    )
    late_s, _ = likeliest_clocks(told, np.array([1e-5, 2e-3, 2e-3]), BOUNDS_S)
    assert late_s == pytest.approx(true_s, abs=1e-5)


def test_what_is_not_known_leaves_the_clocks_as_announced():
    told = np.array([[0.0, 1.0, 0.0, math.inf, 0.0]])
    late_s, cov = likeliest_clocks(told, np.array([1e-3, 2e-3]), BOUNDS_S[:2])
    assert not late_s.any()
    assert np.diag(cov) == pytest.approx([1e-6, 4e-6])


def test_enough_motion_outweighs_what_clocks_claim_and_no_bound_is_passed():
    claimed = np.array([2e-5, 2e-5])
    told = np.array([[0.0, 1.0, 0.004, 1e-9, 0.0]])
    few_s, _ = likeliest_clocks(told, claimed, BOUNDS_S[:2])
    told[0, 4] = 1.0
    many_s, _ = likeliest_clocks(told, claimed, BOUNDS_S[:2])
    assert few_s[1] - few_s[0] < 0.002 < 0.0039 < many_s[1] - many_s[0]
    told[0, 2] = 0.05
    assert np.abs(likeliest_clocks(told, claimed, BOUNDS_S[:2])[0]).max() == BOUNDS_S[0]
