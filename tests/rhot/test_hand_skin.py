"""The skin that touches things, against the hand that the simulator draws."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import DIGITS, JOINT_INDEX, default_hand, forward, joint_radii_m
from rhot.hand_skin import PARTS, skin_of
from services.simulator.hands.bodies import ShapeBuilder, add_hand


def posed(hand, scale):
    model = default_hand(hand, scale)
    angles = np.tile([0.05, 0.5, 0.6, 0.4], (5, 1))
    positions, rotations = forward(model, np.eye(3), np.array([0.1, 0.2, 0.5]), angles)
    return model, positions, rotations


@pytest.mark.parametrize("hand", ["left", "right"])
@pytest.mark.parametrize("scale", [0.8, 1.1])
def test_the_simulators_hand_has_this_very_skin(hand, scale):
    model, positions, rotations = posed(hand, scale)
    skin = skin_of(positions, rotations, joint_radii_m(model), model.side)
    shapes = ShapeBuilder()
    add_hand(shapes, model, 0, 0, {})
    drawn = shapes.arrays()
    own = drawn.frame.max(axis=1) < 26  # the forearm has a frame of its own
    frame, offset = drawn.frame[own], drawn.offset[own]
    ends = positions[frame] + np.einsum("ceij,cej->cei", rotations[frame], offset)
    for one, radii in zip(skin.ends_m, skin.radii_m, strict=True):
        apart = np.abs(ends - one).max(axis=(1, 2)) + np.abs(drawn.radius[own] - radii).max(axis=1)
        assert apart.min() < 1e-12


def test_each_part_once_and_fingers_end_at_their_tips():
    model, positions, rotations = posed("right", 1.0)
    skin = skin_of(positions, rotations, joint_radii_m(model), model.side)
    assert sorted(set(skin.part)) == list(range(len(PARTS)))
    for row, digit in enumerate(DIGITS):
        (only,) = np.flatnonzero(skin.part == row)
        tip = JOINT_INDEX[f"{digit}_tip"]
        end = skin.ends_m[only, 1] - skin.radii_m[only, 1] * rotations[tip][:, 2]
        np.testing.assert_allclose(end, positions[tip], atol=1e-12)
