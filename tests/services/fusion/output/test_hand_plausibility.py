"""Whether points can belong to one hand."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import default_hand
from services.fusion.output.hand_plausibility import coherent, hand_reach_m

HAND_M = np.array(
    [
        [0.0, 0.09, 0.5],
        [-0.07, 0.02, 0.5],
        [-0.03, -0.05, 0.49],
        [0.0, -0.07, 0.49],
        [0.03, -0.06, 0.5],
        [0.05, -0.03, 0.51],
    ]
)
SURE = np.tile(1e-6 * np.eye(3), (6, 1, 1))
ALL = np.ones(6, dtype=bool)


def test_reach_is_that_of_an_adult_hand_and_scales():
    reach = hand_reach_m(default_hand("right"))
    assert 0.17 < reach < 0.21
    assert hand_reach_m(default_hand("left", 0.5)) == pytest.approx(0.5 * reach, rel=0.05)


def test_a_hand_is_kept_and_one_stray_is_left_out():
    assert coherent(HAND_M, SURE, ALL, ALL, 0.19).all()
    stray = HAND_M.copy()
    stray[2] = [0.3, 0.2, 1.1]
    assert coherent(stray, SURE, ALL, ALL, 0.19).tolist() == [True, True, False, True, True, True]


def test_an_uncertain_point_gets_the_benefit_of_its_sigma():
    far, unsure = HAND_M.copy(), SURE.copy()
    far[2, 2] += 0.3
    unsure[2, 2, 2] = 0.1**2
    assert coherent(far, unsure, ALL, ALL, 0.19).all()


def test_if_most_are_strays_all_are_left_out():
    scattered = HAND_M + np.array([[0, 0, d] for d in (0.0, 0.5, 1.0, 1.5, -0.3, 0.9)])
    assert not coherent(scattered, SURE, ALL, ALL, 0.19).any()


def test_one_or_two_points_cannot_be_judged():
    two = np.array([True, False, False, False, False, True])
    apart = HAND_M.copy()
    apart[5, 2] = 1.5
    assert coherent(apart, SURE, two, two, 0.19).tolist() == two.tolist()
    assert not coherent(HAND_M, SURE, np.zeros(6, dtype=bool), ALL, 0.19).any()
