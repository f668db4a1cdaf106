"""The skin is where the joints of the message are, in any pose, of any person, on either hand."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import HANDS, JOINT_INDEX, JOINTS, HandName, default_hand, forward
from rhot.hand_skin import PARTS
from services.viewer.scene.skin_shape import SkinShape, fit_skin

Joints = tuple[Array, Array]
# A finger's flesh about its bone, of an adult: the thickest is the thumb's ball.
FLESH_M = 0.024


def random_joints(hand: HandName, scale: float, rng: np.random.Generator) -> Joints:
    """Joints of a hand anywhere, turned any way, its fingers bent as far as they can be."""
    model = default_hand(hand, scale)
    low, high = np.moveaxis(model.limits_rad, 2, 0)
    angles = rng.uniform(low, high)
    turn = rotation_from_vector(rng.normal(size=3))
    return forward(model, turn, rng.uniform(-1.0, 1.0, 3), angles)


def in_their_joints(shape: SkinShape, joints: Joints) -> list[Array]:
    """What follows one joint alone, in that joint's frame: a list by joint, (m, 3) each."""
    positions, rotations = joints
    vertices, weights = shape.vertices(*joints), shape.blend.reshape(-1, 25, 4)[:, :, 3]
    return [
        (vertices[weights[:, j] > 0.999] - positions[1 + j]) @ rotations[1 + j] for j in range(25)
    ]


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("scale", [0.85, 1.0, 1.15])
def test_joints_of_the_skin_are_those_of_the_message(hand: HandName, scale: float) -> None:
    """In whatever pose: in its joint's frame each vertex stays where it was.

    Fitted to one pose, drawn in others, as a page does that lives for hours.
    """
    rng = np.random.default_rng(7)
    first = random_joints(hand, scale, rng)
    shape = fit_skin(hand, *first)
    at_first = in_their_joints(shape, first)
    # Each digit has skin that follows one joint alone; what lies between two follows both.
    assert sum(len(one) > 0 for one in at_first) >= 10
    for _ in range(20):
        joints = random_joints(hand, scale, rng)
        assert shape.fits(*joints)
        for now, then in zip(in_their_joints(shape, joints), at_first, strict=True):
            np.testing.assert_allclose(now, then, atol=2e-6)


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("scale", [0.85, 1.15])
def test_the_skin_is_about_the_bones_of_the_person(hand: HandName, scale: float) -> None:
    rng = np.random.default_rng(3)
    shape = fit_skin(hand, *random_joints(hand, scale, rng))
    for _ in range(10):
        positions, rotations = random_joints(hand, scale, rng)
        vertices = shape.vertices(positions, rotations)
        weights = shape.blend.reshape(-1, 25, 4)[:, :, 3]
        for name in ("index_proximal", "middle_intermediate", "little_distal", "thumb_proximal"):
            a, b = positions[JOINT_INDEX[name]], positions[JOINT_INDEX[name] + 1]
            own = vertices[weights[:, JOINT_INDEX[name] - 1] > 0.95]
            along = np.clip((own - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            apart = np.linalg.norm(own - a - along[:, None] * (b - a), axis=1)
            assert len(own) > 5
            assert apart.max() < FLESH_M * scale, name


def test_long_fingers_have_a_long_skin() -> None:
    """The skin ends where the finger does, also of who has other proportions than the mesh."""
    for longer in (0.8, 1.0, 1.3):
        model = default_hand("right")
        positions, rotations = forward(model, np.eye(3), np.zeros(3), np.zeros((5, 4)))
        tip, knuckle = JOINT_INDEX["ring_tip"], JOINT_INDEX["ring_proximal"]
        beyond = positions[knuckle + 1 : tip + 1] - positions[knuckle]
        positions[knuckle + 1 : tip + 1] = positions[knuckle] + longer * beyond
        vertices = fit_skin("right", positions, rotations).vertices(positions, rotations)
        ring = rotations[tip][:, 2]
        near = np.linalg.norm(np.cross(vertices - positions[tip], ring), axis=1) < 0.006
        reach = (vertices[near] - positions[tip]) @ -ring
        assert reach.max() == pytest.approx(0.0, abs=0.001), longer


def test_another_person_s_hand_is_noticed() -> None:
    rng = np.random.default_rng(1)
    shape = fit_skin("right", *random_joints("right", 1.0, rng))
    assert not shape.fits(*random_joints("right", 1.05, rng))


@pytest.mark.parametrize("part", PARTS)
def test_a_lit_part_lies_just_over_the_skin_of_that_part(part: str) -> None:
    joints = random_joints("left", 1.0, np.random.default_rng(2))
    shape = fit_skin("left", *joints)
    lit = shape.lit([part])
    vertices = shape.lit_vertices(lit, *joints)
    assert len(lit.faces) > 40
    assert lit.faces.max() == len(vertices) - 1
    skin = shape.vertices(*joints)
    apart = np.linalg.norm(vertices[:, None] - skin[None], axis=2).min(axis=1)
    assert 0.0 < apart.max() < 0.0015
    # It is of that finger, not of the one beside it.
    joint = JOINT_INDEX["palm" if part == "palm" else f"{part}_distal"]
    nearest = np.linalg.norm(vertices.mean(axis=0) - joints[0], axis=1).argmin()
    assert JOINTS[nearest].startswith(part) or part == "palm", JOINTS[joint]


def test_nothing_lit_is_nothing_drawn() -> None:
    shape = fit_skin("right", *random_joints("right", 1.0, np.random.default_rng(0)))
    assert len(shape.lit([]).faces) == 0


@pytest.mark.parametrize("at", [(0.0, 0.0, 0.5), (99.0, 99.0, 99.0)])
def test_a_hand_that_is_none_is_no_nan(at: tuple[float, float, float]) -> None:
    """All joints at one place, as any program on the network may say."""
    positions, rotations = np.tile(at, (26, 1)), np.tile(np.eye(3), (26, 1, 1))
    shape = fit_skin("right", positions, rotations)
    assert np.isfinite(shape.vertices(positions, rotations)).all()
    # A bone that points backwards.
    positions[JOINT_INDEX["index_distal"]] += [0.0, 0.0, 0.1]
    assert np.isfinite(fit_skin("right", positions, rotations).blend).all()
