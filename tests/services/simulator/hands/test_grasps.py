"""Taking and putting back: smooth, in order, inside the limits."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.solids import Cylinder
from rhot.hand import default_hand
from services.simulator.hands.grasps import grasp, stop, timing
from services.simulator.hands.holds import Grip, hold

MODEL = default_hand("right")
HELD = hold(MODEL, Cylinder(0.055, 0.12), Grip())


@pytest.mark.parametrize("carry", [True, False])
@pytest.mark.parametrize("seed", [1, 2, 7])
def test_second_derivatives_are_continuous(seed, carry):
    motion = grasp(HELD, timing(seed, carry=carry))

    def jumps(step_s: float) -> float:
        t = np.arange(0.0, 8.2, step_s)
        states = np.array(
            [
                np.concatenate([g.angles_rad.ravel(), g.turn_rad, 10.0 * g.shift_m])
                for g in map(motion, t)
            ]
        )
        return float(np.abs(np.diff(np.diff(states, 2, axis=0) / step_s**2, axis=0)).max())

    assert jumps(1e-3) < 0.5 * jumps(4e-3) + 1e-3


@pytest.mark.parametrize("seed", range(6))
def test_limits_and_order(seed):
    motion = grasp(HELD, timing(seed))
    limits = MODEL.limits_rad
    for t_s in np.arange(0.0, 8.0, 0.05):
        gesture = motion(float(t_s))
        assert np.all(gesture.angles_rad >= limits[..., 0] - 1e-9)
        assert np.all(gesture.angles_rad <= limits[..., 1] + 1e-9)
        if gesture.grip == 1.0:
            np.testing.assert_allclose(gesture.angles_rad, HELD.closed_rad)
        elif np.any(gesture.angles_rad != HELD.open_rad):
            # What still stands steadies the hand, and it is where it holds it.
            np.testing.assert_allclose((gesture.calm, gesture.calm_digits), 1.0)
            np.testing.assert_allclose(gesture.shift_m, 0.0, atol=1e-12)
            np.testing.assert_allclose(gesture.turn_rad, 0.0, atol=1e-12)


def test_thumbs_come_early_and_late():
    order = {int(np.argsort(timing(seed).close_from_s).argmin()) for seed in range(20)}
    assert 0 in order
    assert len(order) >= 3


def test_a_digit_stops_within_a_seventh_of_its_time():
    assert [stop(u) for u in (-1.0, 0.0, 1.0, 2.0)] == [0.0, 0.0, 1.0, 1.0]
    u = np.linspace(0.0, 1.0, 1001)
    speed = np.diff([stop(float(v)) for v in u]) / np.diff(u)
    assert np.all(speed >= 0.0)
    assert speed[840] == pytest.approx(speed.max())
    assert stop(0.85) < 0.9
