"""The whole-hand problem: its gradient, what it recovers, what it does without markers and with a
wrong one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import angle_between, rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, JOINTS, LANDMARKS, HandName
from services.solver.maths.kinematics import hand_chains
from services.solver.maths.rotation_vectors import turned
from services.solver.whole_hand import fit
from services.solver.whole_hand.motion_prior import Belief, unknown
from services.solver.whole_hand.posture_prior import habit

FULL = (
    *BASIC_LANDMARKS,
    *(name for name in LANDMARKS if name.endswith(("proximal", "intermediate", "distal"))),
)


def _marks(model, places, sigma_m: float = 1e-3) -> fit.Marks:
    where = [fit.place_of(model, name) for name in places]
    return fit.Marks(
        joint=np.array([w[0] for w in where]),
        digit=np.array([w[1] for w in where]),
        depth=np.array([w[2] for w in where]),
        offset_m=np.array([w[3] for w in where]),
        point_m=np.array(list(places.values())),
        inverse_sigma=np.full((len(where), 3), 1.0 / sigma_m),
    )


@pytest.mark.parametrize("hand", ["right", "left"])
def test_gradient_is_the_derivative_of_the_cost(world: Callable, hand: HandName) -> None:
    ours = world(hand)
    chains, rng = hand_chains(ours.model), np.random.default_rng(1)
    instant = ours.motion(1, 1)[0]
    marks = _marks(ours.model, ours.points(instant, LANDMARKS), 0.02)
    A = rng.normal(size=(26, 26))
    belief = Belief(instant.rotation, instant.position_m, instant.angles_rad, A @ A.T)
    # Small enough a turn for the belief's rotation vector to be linear.
    R, t = rotation_from_vector([1e-4, -2e-4, 1e-4]) @ instant.rotation, instant.position_m + 0.003
    q = np.clip(instant.angles_rad + rng.normal(0.0, 0.1, (5, 4)), -0.5, 1.5)
    H, g, h, unused = np.empty((26, 26)), np.empty(26), 1e-6, np.empty(26)
    fit._normal_equations(chains, marks, belief, R, t, q, H, g)

    def cost(step: np.ndarray) -> float:
        there = turned(R, step[:3]), t + step[3:6], q + step[6:].reshape(5, 4)
        return fit._normal_equations(chains, marks, belief, *there, np.empty((26, 26)), unused)

    slope = np.array([(cost(h * e) - cost(-h * e)) / (2 * h) for e in np.eye(26)])
    np.testing.assert_allclose(2.0 * g, slope, rtol=1e-3, atol=1e-3 * np.abs(slope).max())
    np.testing.assert_allclose(H, H.T)
    assert np.linalg.eigvalsh(H).min() > 0.0


@pytest.mark.parametrize("hand", ["right", "left"])
def test_with_every_joint_painted_the_hand_is_exact(world: Callable, hand: HandName) -> None:
    ours = world(hand)
    chains, nothing = hand_chains(ours.model), unknown(habit(ours.model))
    for instant in ours.motion(2, 30)[::10]:
        marks = _marks(ours.model, ours.points(instant, FULL), 1e-4)
        R = rotation_from_vector([0.3, -0.2, 0.1]) @ instant.rotation
        t, q, information = instant.position_m + 0.02, nothing.angles.copy(), np.empty((26, 26))
        fit.fit(chains, marks, nothing, R, t, q, 60, information)
        assert angle_between(R, instant.rotation) < 2e-3
        np.testing.assert_allclose(t, instant.position_m, atol=2e-4)
        np.testing.assert_allclose(q, instant.angles_rad, atol=0.02)


def test_the_covariance_tells_the_error(world: Callable) -> None:
    """Angle errors in standard deviations: about 1 on average, hardly any beyond 4."""
    ours, rng, ratios = world("right"), np.random.default_rng(3), []
    chains, nothing = hand_chains(ours.model), unknown(habit(ours.model))
    for instant in ours.motion(3, 200)[::4]:
        places = {
            name: p + rng.normal(0.0, 1e-3, 3) for name, p in ours.points(instant, FULL).items()
        }
        R, t, q = instant.rotation.copy(), instant.position_m.copy(), nothing.angles.copy()
        information = np.empty((26, 26))
        fit.fit(chains, _marks(ours.model, places), nothing, R, t, q, 60, information)
        sigma = np.sqrt(np.diag(np.linalg.inv(information)))[6:].reshape(5, 4)
        ratios.append(((q - instant.angles_rad) / sigma)[1:, 1:])
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.4
    assert np.mean(np.abs(ratios) > 4.0) < 0.01


def test_one_wrong_marker_does_not_bend_the_hand(world: Callable) -> None:
    ours = world("right")
    chains, nothing = hand_chains(ours.model), unknown(habit(ours.model))
    instant = ours.motion(4, 1)[0]
    places = ours.points(instant, FULL)
    places["ring_tip"] = places["ring_tip"] + 0.05
    R, t, q = instant.rotation.copy(), instant.position_m.copy(), nothing.angles.copy()
    fit.fit(chains, _marks(ours.model, places), nothing, R, t, q, 60, np.empty((26, 26)))
    assert angle_between(R, instant.rotation) < np.deg2rad(1.0)
    np.testing.assert_allclose(
        q[[1, 2, 4], 1:], instant.angles_rad[[1, 2, 4], 1:], atol=np.deg2rad(6.0)
    )


def test_without_markers_the_belief_stands(world: Callable) -> None:
    ours = world("right")
    instant = ours.motion(5, 1)[0]
    belief = Belief(instant.rotation, instant.position_m, instant.angles_rad, np.eye(26))
    none = fit.Marks(*(np.zeros(0, np.int64),) * 3, *(np.zeros((0, 3)),) * 3)
    R, t, q = instant.rotation.copy(), instant.position_m.copy(), instant.angles_rad.copy()
    cost, _ = fit.fit(hand_chains(ours.model), none, belief, R, t, q, 30, np.empty((26, 26)))
    assert cost == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(q, instant.angles_rad, atol=1e-9)


def test_the_middle_finger_never_abducts(world: Callable) -> None:
    ours = world("right")
    instant = ours.motion(6, 1)[0]
    places = ours.points(instant)
    places["middle_tip"] = places["middle_tip"] + instant.rotation @ np.array([0.02, 0.0, 0.0])
    nothing = unknown(habit(ours.model))
    R, t, q = instant.rotation.copy(), instant.position_m.copy(), nothing.angles.copy()
    fit.fit(
        hand_chains(ours.model),
        _marks(ours.model, places),
        nothing,
        R,
        t,
        q,
        60,
        np.empty((26, 26)),
    )
    assert q[2, 0] == 0.0


def test_every_landmark_has_a_place(world: Callable) -> None:
    model = world("left").model
    for name in LANDMARKS:
        joint, digit, depth, _ = fit.place_of(model, name)
        assert JOINTS[joint] == name
        assert (digit >= 0) == (depth > 0)
