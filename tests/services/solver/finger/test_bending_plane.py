"""A digit in its plane of bending: the planar kinematics are those of the hand model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.hand import default_hand
from services.solver.finger import analytic
from services.solver.finger.bending_plane import (
    abduction_towards,
    bending_plane,
    clamp_angle,
    forward_coordinate,
    planar_tip,
    wrap_angle,
)
from services.solver.maths.chains import digit_chain, hand_chains

INDEX = digit_chain(hand_chains(default_hand()), 1)
OFF_AXIS = INDEX._replace(tool=np.array([0.002, -0.003, -0.012]))


@pytest.mark.parametrize("chain", [INDEX, OFF_AXIS], ids=["on the axis", "off the axis"])
def test_the_planar_tip_agrees_with_the_hand_model(
    chain: object, within: Callable, tip_pose: Callable
) -> None:
    plane, rng = bending_plane(chain), np.random.default_rng(1)
    for _ in range(50):
        q = within(rng, chain.limits, False)
        point, _ = tip_pose(chain, q)
        planar = planar_tip(plane, *q[1:])
        np.testing.assert_allclose(planar, (forward_coordinate(point, q[0]), -point[1]), atol=1e-12)


def test_the_coupled_tip_agrees_with_the_planar_one(within: Callable) -> None:
    """The closed form's own kinematics, and their derivatives by finite differences."""
    plane, rng = bending_plane(OFF_AXIS), np.random.default_rng(2)
    for second in rng.uniform(0.05, 1.3, 50):
        *tip, d_forward, d_palmar = analytic._coupled_tip(plane, second)
        expected = planar_tip(plane, 0.0, second, 2.0 / 3.0 * second)
        np.testing.assert_allclose(tip, expected, atol=1e-12)
        ahead = np.array(analytic._coupled_tip(plane, second + 1e-6)[:2])
        behind = np.array(analytic._coupled_tip(plane, second - 1e-6)[:2])
        np.testing.assert_allclose((ahead - behind) / 2e-6, (d_forward, d_palmar), atol=1e-9)


def test_abduction_turns_the_plane_onto_the_target(within: Callable, tip_pose: Callable) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        q = within(rng, INDEX.limits, True)
        point, _ = tip_pose(OFF_AXIS, q)
        branch = 1 if forward_coordinate(point, q[0]) > 0.0 else -1
        found = abduction_towards(point, OFF_AXIS.tool[0], branch, 0.0, INDEX.limits[0])
        assert found == pytest.approx(q[0], abs=1e-9)


def test_a_target_on_the_axis_of_abduction_leaves_it_as_it_was() -> None:
    on_axis = np.array([0.0, -0.05, 0.0])
    assert abduction_towards(on_axis, 0.0, 1, 0.1, np.array([-0.2, 0.2])) == 0.1
    assert abduction_towards(on_axis, 0.0, 1, 0.9, np.array([-0.2, 0.2])) == 0.2


def test_angles_are_clamped_to_the_end_that_is_nearer_around_the_circle() -> None:
    assert wrap_angle(3.0 * np.pi - 0.1) == pytest.approx(np.pi - 0.1)
    assert clamp_angle(0.5, 0.0, 1.0) == 0.5
    assert clamp_angle(0.5 + 2.0 * np.pi, 0.0, 1.0) == pytest.approx(0.5)
    assert clamp_angle(-2.0, 0.0, 1.5) == 0.0
    assert clamp_angle(-3.0, 0.0, 1.5) == 1.5
