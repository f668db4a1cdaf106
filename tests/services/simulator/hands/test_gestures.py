"""Motions are smooth, stay inside any hand's limits, and look like what they are called."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.hand import HandModel, default_hand
from services.simulator.hands.gestures import MOTIONS, bump, smootherstep


def narrow_hand() -> HandModel:
    """A stiff left hand: two thirds of each range, DIP at most 30 deg, and a middle finger that
    does abduct.
    """
    model = default_hand("left", 0.8)
    digits = []
    for digit in model.digits:
        limits = [(2 / 3 * low, 2 / 3 * high) for low, high in digit.limits_rad]
        limits[3] = (0.0, np.deg2rad(30.0))
        if digit.name == "middle":
            limits[0] = (-0.05, 0.02)
        digits.append(msgspec.structs.replace(digit, limits_rad=tuple(limits)))
    return msgspec.structs.replace(model, digits=tuple(digits))


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("model", [default_hand("right"), narrow_hand()], ids=["average", "stiff"])
@settings(max_examples=40, deadline=None)
@given(t_s=st.floats(-1e4, 1e5), seed=st.integers(0, 3))
def test_no_limit_is_ever_passed(name, model, t_s, seed):
    angles = MOTIONS[name](model, seed)(t_s).angles_rad
    limits = model.limits_rad
    assert np.all(np.isfinite(angles))
    assert np.all(angles >= limits[..., 0] - 1e-12)
    assert np.all(angles <= limits[..., 1] + 1e-12)


@pytest.mark.parametrize("name", MOTIONS)
def test_second_derivatives_are_continuous(name):
    motion = MOTIONS[name](default_hand("right"), 3)

    def jumps(step_s: float) -> float:
        """The largest change of the second derivative from step to step."""
        t = np.arange(0.0, 8.2, step_s)
        states = np.array(
            [
                np.concatenate([g.angles_rad.ravel(), g.turn_rad, 10.0 * g.shift_m])
                for g in map(motion, t)
            ]
        )
        return float(np.abs(np.diff(np.diff(states, 2, axis=0) / step_s**2, axis=0)).max())

    # A jump of the second derivative would stay the same however fine the steps.
    coarse, fine = jumps(8e-3), jumps(2e-3)
    assert fine < 0.5 * coarse + 1e-3


def test_fist_closes_in_two_seconds_and_mcp_lags():
    motion = MOTIONS["fist"](default_hand("right"), 1)
    t = np.arange(0.0, 4.0, 0.01)
    angles = np.rad2deg([motion(s).angles_rad[1] for s in t])  # index finger (n, 4)
    mcp, pip, dip = angles[:, 1], angles[:, 2], angles[:, 3]
    np.testing.assert_allclose(dip, 2 / 3 * pip, atol=1e-9)
    assert pip.max() > 95.0
    assert mcp.max() > 75.0
    start = t[np.argmin(pip[:200])]
    third = np.searchsorted(t, start + 2.0 / 3.0)
    # The study: MCP hardly moves during the first third of the closing, PIP does from the start.
    assert mcp[third] - mcp.min() < 0.05 * np.ptp(mcp)
    assert pip[third] - pip.min() > 0.2 * np.ptp(pip)
    assert t[np.argmax(mcp)] - start == pytest.approx(2.0, abs=0.3)


def test_all_motions_but_still_move_all_fingers_or_the_hand():
    for name, make in MOTIONS.items():
        motion = make(default_hand("right"), 1)
        states = np.array(
            [
                np.concatenate([motion(t).angles_rad.ravel(), motion(t).turn_rad])
                for t in np.arange(0.0, 8.0, 0.1)
            ]
        )
        moving = np.ptp(states, axis=0).max()
        assert (moving < 1e-12) if name == "still" else (moving > 0.2)


def test_random_motions_follow_their_seed():
    model = default_hand("right")
    a, b, c = (MOTIONS["random"](model, seed)(1.7).angles_rad for seed in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 0.05


def test_ramps_begin_and_end_where_they_should():
    assert [smootherstep(u) for u in (-1.0, 0.0, 0.5, 1.0, 2.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]
    assert [bump(u) for u in (0.0, 0.5, 1.0, 3.0)] == [0.0, 1.0, 0.0, 0.0]
