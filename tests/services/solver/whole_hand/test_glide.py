"""What is told of a hand that is believed to have jumped: it glides, unless landmarks moved too."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import Array, angle_between, rotation_from_vector
from services.solver.whole_hand.glide import Told
from services.solver.whole_hand.hand_estimate import HandEstimate, offset
from services.solver.whole_hand.landmarks import Observations

FRAME_S = 1.0 / 30.0
LAST = HandEstimate(np.eye(3), np.zeros(3), np.full((5, 4), 0.1), 1e-4 * np.eye(26), 10.0, 4)
# The middle finger spreads no way.
LAST.angles_rad[2, 0] = 0.0
# The index finger, at its PIP joint.
BENT = LAST.angles_rad.copy()
BENT[1, 2] += 0.5


@pytest.fixture
def hand(world: Callable) -> Callable[..., tuple[dict[str, Array], Array]]:
    """Landmarks of a hand, and its limits."""
    one = world("right")
    places = one.points(one.motion(1, 1)[0])
    return lambda: (dict(places), one.model.limits_rad)


def _then(told: Told, own: HandEstimate, seen: Observations, limits: Array) -> HandEstimate:
    return told.then(own, told.names, seen, limits, FRAME_S).estimate


def test_small_changes_are_told_as_they_are(
    hand: Callable, world: Callable, observe: Callable
) -> None:
    places, limits = hand()
    seen = observe(world("right").model, places)
    own = LAST._replace(
        angles_rad=LAST.angles_rad + 0.1,
        rotation=rotation_from_vector(np.array([0.1, 0.0, 0.0])),
    )
    told = Told(LAST, tuple(places), seen.point_m)
    assert _then(told, own, seen, limits) is own


def test_a_jump_without_motion_glides_and_arrives(
    hand: Callable, world: Callable, observe: Callable
) -> None:
    places, limits = hand()
    seen = observe(world("right").model, places)
    own = LAST._replace(angles_rad=BENT, rotation=rotation_from_vector(np.array([0.5, 0.0, 0.0])))
    told = Told(LAST, tuple(places), seen.point_m)
    first = _then(told, own, seen, limits)
    assert 0.05 < first.angles_rad[1, 2] - 0.1 < 0.2
    assert 0.05 < angle_between(np.eye(3), first.rotation) < 0.2
    # How far it is from what is believed is told.
    off = offset(first, own)
    assert first.covariance[0, 0] >= off[0] ** 2
    for _ in range(5):
        told = told.then(own, told.names, seen, limits, FRAME_S)
    assert told.estimate is own


def test_what_landmarks_do_is_not_held_back(
    hand: Callable, world: Callable, observe: Callable
) -> None:
    """A hand that turned with its landmarks; a finger whose tip moved."""
    places, limits = hand()
    told = Told(LAST, tuple(places), observe(world("right").model, places).point_m)
    turn = rotation_from_vector(np.array([0.5, 0.0, 0.0]))
    turned = observe(world("right").model, {name: turn @ place for name, place in places.items()})
    found = _then(told, LAST._replace(rotation=turn), turned, limits)
    np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
    places["index_tip"] = places["index_tip"] + [0.0, 0.0, 0.05]
    moved = observe(world("right").model, places)
    found = _then(told, LAST._replace(angles_rad=BENT), moved, limits)
    np.testing.assert_allclose(found.angles_rad, BENT, atol=1e-9)


def test_the_rest_follows_a_turn_that_is_held_back(
    hand: Callable, world: Callable, observe: Callable
) -> None:
    """What goes with the turn in the covariance: here, a joint as much as the wrist."""
    places, limits = hand()
    seen = observe(world("right").model, places)
    covariance = 1e-4 * np.eye(26)
    covariance[0, 6 + 5] = covariance[6 + 5, 0] = 0.9e-4
    own = LAST._replace(
        angles_rad=LAST.angles_rad.copy(),
        rotation=rotation_from_vector(np.array([0.5, 0.0, 0.0])),
        covariance=covariance,
    )
    own.angles_rad[1, 1] += 0.45
    told = _then(Told(LAST, tuple(places), seen.point_m), own, seen, limits)
    held = 0.5 - angle_between(np.eye(3), told.rotation)
    assert own.angles_rad[1, 1] - told.angles_rad[1, 1] == pytest.approx(0.9 * held, abs=1e-9)
