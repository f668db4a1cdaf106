"""Distances of a whole hand, with their sigma."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.geometry.solids import Sphere
from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand_skin import PARTS
from services.object_tracker.contacts.distances import (
    NEAR_M,
    is_near,
    part_distances,
    seen_hand,
)


@pytest.fixture
def holding(recorded):
    """(hand, object) while the cup is held, and the true distances."""
    scene, recording = recorded(seed=1, noise=0.0)
    hand = next(one for one in recording.hands if one.stamp_ns > 10**18 + 2.6e9)
    # 90 Hz: the nearest pose is half a step away at most.
    cup = min(recording.objects, key=lambda one: abs(one.stamp_ns - hand.stamp_ns))
    return scene, hand, cup


def test_the_truth_without_noise(holding):
    scene, hand, cup = holding
    found = part_distances(seen_hand(hand), cup, scene.solid)
    assert [one.part for one in found] == list(PARTS)
    truth = scene.distances(scene.at((hand.stamp_ns - 10**18) * 1e-9))
    # The solver leaves a millimetre or so of a hand it knows by six points, the cup's pose its own.
    np.testing.assert_allclose([one.distance_m for one in found], truth, atol=4e-3)
    R = rotation_from_quaternion(cup.orientation_wxyz)
    for one in found:
        local = R.T @ (one.point_m - np.array(cup.position_m))
        assert abs(scene.solid.distance(local[None]).distance_m[0]) < 1e-9
        assert np.linalg.norm(one.normal) == pytest.approx(1.0)
        assert not one.predicted


def test_sigma_is_that_of_what_was_seen(holding):
    scene, hand, cup = holding
    index = PARTS.index("index")

    def sigma(hand=hand, cup=cup):
        return part_distances(seen_hand(hand), cup, scene.solid)[index].sigma_m

    assert 0.001 < sigma() < 0.006
    assert sigma(cup=msgspec.structs.replace(cup, sigma_m=0.02)) > 0.011
    unseen = [
        msgspec.structs.replace(joint, source="predicted") if "index" in joint.name else joint
        for joint in hand.joints
    ]
    assert sigma(hand=msgspec.structs.replace(hand, joints=unseen)) > sigma()
    fingers = list(hand.fingers)
    fingers[index] = msgspec.structs.replace(fingers[index], residual_m=0.01)
    assert sigma(hand=msgspec.structs.replace(hand, fingers=fingers)) > 0.0099


def test_a_predicted_finger_says_so(holding):
    scene, hand, cup = holding
    fingers = list(hand.fingers)
    fingers[2] = msgspec.structs.replace(fingers[2], status="predicted")
    found = part_distances(
        seen_hand(msgspec.structs.replace(hand, fingers=fingers)), cup, scene.solid
    )
    assert [one.part for one in found if one.predicted] == ["middle"]


def test_far_hands_are_left_out(holding):
    _, hand, cup = holding
    ball, (x, y, z) = Sphere(0.07), cup.position_m
    assert is_near(seen_hand(hand), cup, ball)
    away = msgspec.structs.replace(cup, position_m=(x, y, z + NEAR_M + 0.4))
    assert not is_near(seen_hand(hand), away, ball)
