"""Which law DIP follows: a line, or a parabola where closings left out say so."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.recover.laws import fit_law, law_support


def closings(law, count: int, noise_deg: float, seed: int = 1, wander_deg: float = 0.0):
    """PIP and DIP of closings; wander: each one's own smooth deviation from the law."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        pip = np.deg2rad(np.linspace(6.0, 100.0, 37))
        own = np.deg2rad(rng.normal(0.0, wander_deg)) * np.sin(np.pi * np.arange(37) / 36)
        dip = law[0] + law[1] * pip + law[2] * pip**2 + own
        made.append((pip, dip + np.deg2rad(rng.normal(0.0, noise_deg, 37))))
    return made


def test_coefficients_are_found():
    (pip, dip), *_ = closings((0.05, 0.5, 0.1), 1, 0.0)
    assert fit_law(pip, dip, 2).coefficients == pytest.approx((0.05, 0.5, 0.1))
    assert fit_law(pip[:4], dip[:4], 2) is None
    assert fit_law(np.full(30, 0.3), dip[:30], 1) is None


def test_a_law_goes_on_straight_beyond_what_was_measured():
    (pip, dip), *_ = closings((0.0, 0.8, -0.2), 1, 0.0)
    law = fit_law(pip, dip, 2)
    beyond = law.dip(np.deg2rad([100.0, 110.0, 120.0]))
    assert np.diff(beyond)[0] == pytest.approx(np.diff(beyond)[1])


def test_a_straight_law_is_a_line_and_a_bent_one_a_parabola():
    line = law_support(closings((0.03, 0.6, 0.0), 5, 1.0, wander_deg=2.0))
    assert line.better == "line"
    bent = law_support(closings((0.04, 0.15, 0.36), 5, 1.0, wander_deg=2.0))
    assert bent.better == "parabola"
    assert bent.f_test_p < 1e-6
    assert bent.parabola.unseen_rms_deg < bent.line.unseen_rms_deg


def test_frames_of_one_closing_are_no_witnesses_of_their_own():
    """Where closings wander, AIC and F test see a parabola in a straight law; left-out ones do not.

    Of 40 people whose law is straight.
    """
    supports = [
        law_support(closings((0.0, 0.6, 0.0), 5, 0.3, seed, wander_deg=3.0)) for seed in range(40)
    ]
    chance = sum(one.f_test_p < 0.05 for one in supports)
    taken = sum(one.better == "parabola" for one in supports)
    assert chance >= 20
    assert taken <= 10


def test_two_thirds_is_compared_and_few_closings_are_told():
    found = law_support(closings((0.0, 0.9, 0.0), 2, 0.5))
    assert found.two_thirds_max_deg == pytest.approx((0.9 - 2 / 3) * 100.0, abs=2.0)
    assert found.line.unseen_rms_deg is None
    assert "BIC alone" in found.why
    assert law_support([(np.full(37, np.nan), np.full(37, np.nan))]) is None
