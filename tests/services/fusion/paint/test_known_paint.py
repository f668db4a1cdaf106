"""Directions of paint between the poses that tell them."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import default_hand
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.observations import Landmark
from services.fusion.paint.known_paint import correct_paint
from services.fusion.paint.paint_to_bone import Directions, PaintToBone
from testing.synthetic_points import SyntheticRig

CAMERAS = tuple(SyntheticRig().rig().values())
LANDMARKS = (Landmark("right", "wrist"), Landmark("right", "index_tip"))
POSITIONS = np.array([[0.0, 0.1, 0.5], [0.03, -0.05, 0.5]])
NOW_NS, FRAME_NS = 10**18, 33_000_000


@pytest.fixture
def paint() -> PaintToBone:
    return PaintToBone(LANDMARKS, {"right": default_hand("right")}, CAMERAS)


def note_tilt(paint: PaintToBone, angle_rad: float, stamp_ns: int, sigma_rad: float = 0.02) -> None:
    """A hand tilted by an angle about x: the skin of its wrist, and its index finger."""
    turn = rotation_from_vector([angle_rad, 0.0, 0.0])
    directions = np.array([turn @ [0.0, -1.0, 0.0], turn @ [0.0, 0.0, -1.0]])
    hinges = np.tile([1.0, 0.0, 0.0], (2, 1))
    sigmas_rad = np.full((2, 2), sigma_rad)
    paint.note(Directions("right", stamp_ns, np.arange(2), directions, hinges, sigmas_rad, 1.0))


def corrected(paint: PaintToBone, instant_ns: int) -> Array:
    """Landmarks (2, 3) that both cameras see at an instant."""
    return with_covariances(paint, instant_ns)[0]


def with_covariances(paint: PaintToBone, instant_ns: int) -> tuple[Array, Array]:
    """Such landmarks, and how sure they are (2, 3, 3)."""
    places, covariances = POSITIONS.copy(), np.tile(1e-8 * np.eye(3), (2, 1, 1))
    both = np.ones((2, 2), dtype=bool)
    correct_paint(paint.known, instant_ns, places, covariances, both, extrinsics(CAMERAS))
    return places, covariances


@pytest.mark.parametrize("step_rad", [0.0, 0.1, -0.3])
def test_what_turns_is_aimed_where_it_is_by_now(paint: PaintToBone, step_rad: float) -> None:
    """Fingers and skin turn on by as much as they did between the last two poses."""
    for k in range(2):
        note_tilt(paint, 0.5 + k * step_rad, NOW_NS + k * FRAME_NS)
    stale = corrected(paint, NOW_NS + FRAME_NS)
    aimed = corrected(paint, NOW_NS + 2 * FRAME_NS)
    paint.reset()
    note_tilt(paint, 0.5 + 2 * step_rad, NOW_NS)
    true = corrected(paint, NOW_NS)
    errors = np.linalg.norm(aimed - true, axis=1)
    assert (errors <= 0.2 * np.linalg.norm(stale - true, axis=1) + 1e-9).all()


@pytest.mark.parametrize("apart_ns", [0, -FRAME_NS, 10 * FRAME_NS])
def test_what_was_told_long_ago_or_later_says_nothing_of_a_turn(
    paint: PaintToBone, apart_ns: int
) -> None:
    note_tilt(paint, 0.3, NOW_NS - apart_ns)
    note_tilt(paint, 0.5, NOW_NS)
    np.testing.assert_array_equal(corrected(paint, NOW_NS + FRAME_NS), corrected(paint, NOW_NS))


def test_what_jumped_to_another_posture_does_not_turn_on(paint: PaintToBone) -> None:
    for k in range(2):
        note_tilt(paint, 0.1 + 0.9 * k, NOW_NS + k * FRAME_NS)
    now, later = (corrected(paint, NOW_NS + k * FRAME_NS) for k in (1, 2))
    np.testing.assert_array_equal(now, later)


def test_directions_are_as_sure_as_areas_say(paint: PaintToBone) -> None:
    """Half of what a pose told is as if it had told half of it."""
    note_tilt(paint, 0.5, NOW_NS, 0.3)
    paint.known.direction_shares[:] = 0.5
    halved = with_covariances(paint, NOW_NS)
    paint.reset()
    note_tilt(paint, 0.5, NOW_NS, 0.15)
    paint.known.direction_shares[:] = 1.0
    told = with_covariances(paint, NOW_NS)
    for found, wanted in zip(halved, told, strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-15)
