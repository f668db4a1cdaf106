"""Digits close until their last bones touch, and no bone goes through the solid."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.solids import Box, Cylinder, Sphere
from rhot.geometry.transforms import inverse
from rhot.hand import DIGITS, default_hand, forward
from rhot.hand_skin import PARTS
from services.simulator.hands.bodies import ShapeBuilder, add_hand
from services.simulator.hands.closing import bones, reaches
from services.simulator.hands.families import varied_hand
from services.simulator.hands.holds import Grip, hold, part_distances, skin_at

CUP = Cylinder(0.055, 0.12)
SOLIDS = {
    "thin": Cylinder(0.03, 0.12),
    "cup": CUP,
    "wide": Cylinder(0.08, 0.12),
    "box": Box((0.05, 0.12, 0.04)),
    "ball": Sphere(0.07),
}


def distances(model, solid, held) -> np.ndarray:
    skin = skin_at(model, *forward(model, np.eye(3), np.zeros(3), held.closed_rad))
    return part_distances(solid, skin, inverse(held.T_wrist_from_object))


@pytest.mark.parametrize("name", SOLIDS)
def test_digits_that_touch_are_pressed_in_by_a_tenth_of_a_millimetre(name):
    model = default_hand("right")
    held = hold(model, SOLIDS[name], Grip())
    gaps = distances(model, SOLIDS[name], held)
    touching = np.array(held.touching)
    assert touching[1:].sum() >= 3
    np.testing.assert_allclose(gaps[:5][touching], -1e-4, atol=2e-4)
    assert np.all(gaps[:5][~touching] > -3e-4)
    assert gaps[PARTS.index("palm")] > -1e-3


def test_the_thumb_presses_against_the_fingers():
    model = default_hand("right")
    held = hold(model, CUP, Grip())
    assert held.touching[0]
    thumb, *fingers = (
        reach.closed(angles, touching=True).normal
        for reach, angles, touching in zip(
            reaches(model, CUP, held.T_wrist_from_object, 0.0),
            held.closed_rad,
            held.touching,
            strict=True,
        )
        if touching
    )
    assert len(fingers) >= 3
    assert thumb @ np.mean(fingers, axis=0) < -0.5


@pytest.mark.parametrize("hand", ["left", "right"])
@pytest.mark.parametrize("seed", [2, 5])
def test_no_bone_is_inside_and_no_limit_passed(hand, seed):
    model = varied_hand(hand, seed)
    held = hold(model, CUP, Grip())
    for reach, angles in zip(
        reaches(model, CUP, held.T_wrist_from_object, 0.0), held.closed_rad, strict=True
    ):
        assert reach.gaps(angles[None]).min() > -6e-4
    limits = model.limits_rad
    for angles in (held.open_rad, held.closed_rad):
        assert np.all(angles >= limits[..., 0] - 1e-9)
        assert np.all(angles <= limits[..., 1] + 1e-9)


def test_hands_mirror():
    left, right = (hold(default_hand(name), CUP, Grip()) for name in ("left", "right"))
    np.testing.assert_allclose(left.closed_rad, right.closed_rad, atol=1e-4)
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(
        left.T_wrist_from_object[:3, 3] * mirror, right.T_wrist_from_object[:3, 3], atol=1e-5
    )


def test_a_gap_is_kept_all_round():
    model = default_hand("right")
    gaps = distances(model, CUP, hold(model, CUP, Grip(gap_m=0.010)))
    assert np.all(gaps > 0.009)
    assert np.sum(gaps < 0.0105) >= 5


def test_bones_are_those_that_are_drawn():
    model = varied_hand("left", 3)
    angles = model.limits_rad.mean(axis=2)
    shapes = ShapeBuilder()
    add_hand(shapes, model, 0, 0, {})
    table = shapes.arrays()
    positions, rotations = forward(model, np.eye(3), np.zeros(3), angles)
    for row, digit in enumerate(model.digits):
        ends, radii = bones(digit, model.side, angles[row][None])
        for bone in range(3):
            c = 3 * row + bone
            drawn = [
                positions[f] + rotations[f] @ table.offset[c, k]
                for k, f in enumerate(table.frame[c])
            ]
            np.testing.assert_allclose(ends[0, bone], drawn, atol=1e-9)
            np.testing.assert_allclose(radii[bone], table.radius[c])


def test_hands_of_a_family_differ_within_their_bounds():
    average = default_hand("right").lengths_m
    shares = []
    for seed in range(30):
        model = varied_hand("right", seed)
        used = average > 0.0
        share = model.lengths_m[used] / average[used]
        assert np.all(share > 0.8 * 0.9 - 1e-9)
        assert np.all(share < 1.15 * 1.1 + 1e-9)
        shares.append(share.mean())
        assert {digit.name for digit in model.digits} == set(DIGITS)
    assert np.ptp(shares) > 0.2
    assert varied_hand("right", 4) == varied_hand("right", 4)
