"""The whole-hand fit: what it recovers, without landmarks, and with a wrong one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import angle_between, rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, LANDMARKS, HandName
from services.solver.maths.chains import hand_chains
from services.solver.whole_hand.fit import fit
from services.solver.whole_hand.priors.motion_prior import PosePrior, uninformed_prior
from services.solver.whole_hand.priors.posture_prior import posture_prior
from services.solver.whole_hand.residuals import Pose

FULL = (
    *BASIC_LANDMARKS,
    *(name for name in LANDMARKS if name.endswith(("proximal", "intermediate", "distal"))),
)


def _information() -> np.ndarray:
    return np.empty((26, 26))


@pytest.mark.parametrize("hand", ["right", "left"])
def test_with_every_joint_painted_the_hand_is_exact(
    world: Callable, observe: Callable, hand: HandName
) -> None:
    ours = world(hand)
    chains, prior = hand_chains(ours.model), uninformed_prior(posture_prior(ours.model))
    for instant in ours.motion(2, 30)[::10]:
        observations = observe(ours.model, ours.points(instant, FULL), 1e-4)
        R = rotation_from_vector([0.3, -0.2, 0.1]) @ instant.rotation
        pose = Pose(R, instant.position_m + 0.02, prior.angles.copy())
        fit(chains, observations, prior, pose, 60, _information())
        assert angle_between(pose.rotation, instant.rotation) < 2e-3
        np.testing.assert_allclose(pose.position_m, instant.position_m, atol=2e-4)
        np.testing.assert_allclose(pose.angles, instant.angles_rad, atol=0.02)


def test_the_covariance_tells_the_error(world: Callable, observe: Callable) -> None:
    """Angle errors in standard deviations: about 1 on average, hardly any beyond 4."""
    ours, rng, ratios = world("right"), np.random.default_rng(3), []
    chains, prior = hand_chains(ours.model), uninformed_prior(posture_prior(ours.model))
    for instant in ours.motion(3, 200)[::4]:
        points = {
            name: p + rng.normal(0.0, 1e-3, 3) for name, p in ours.points(instant, FULL).items()
        }
        pose = Pose(instant.rotation.copy(), instant.position_m.copy(), prior.angles.copy())
        information = _information()
        fit(chains, observe(ours.model, points), prior, pose, 60, information)
        sigma = np.sqrt(np.diag(np.linalg.inv(information)))[6:].reshape(5, 4)
        ratios.append(((pose.angles - instant.angles_rad) / sigma)[1:, 1:])
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.4
    assert np.mean(np.abs(ratios) > 4.0) < 0.01


def test_one_wrong_landmark_does_not_bend_the_hand(world: Callable, observe: Callable) -> None:
    ours = world("right")
    chains, prior = hand_chains(ours.model), uninformed_prior(posture_prior(ours.model))
    instant = ours.motion(4, 1)[0]
    points = ours.points(instant, FULL)
    points["ring_tip"] = points["ring_tip"] + 0.05
    pose = Pose(instant.rotation.copy(), instant.position_m.copy(), prior.angles.copy())
    fit(chains, observe(ours.model, points), prior, pose, 60, _information())
    assert angle_between(pose.rotation, instant.rotation) < np.deg2rad(1.0)
    np.testing.assert_allclose(
        pose.angles[[1, 2, 4], 1:], instant.angles_rad[[1, 2, 4], 1:], atol=np.deg2rad(6.0)
    )


def test_without_landmarks_the_prior_stands(world: Callable, observe: Callable) -> None:
    ours = world("right")
    instant = ours.motion(5, 1)[0]
    prior = PosePrior(instant.rotation, instant.position_m, instant.angles_rad, np.eye(26))
    pose = Pose(instant.rotation.copy(), instant.position_m.copy(), instant.angles_rad.copy())
    none = observe(ours.model, {})
    cost, _ = fit(hand_chains(ours.model), none, prior, pose, 30, _information())
    assert cost == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(pose.angles, instant.angles_rad, atol=1e-9)


def test_the_middle_finger_never_abducts(world: Callable, observe: Callable) -> None:
    ours = world("right")
    instant = ours.motion(6, 1)[0]
    points = ours.points(instant)
    points["middle_tip"] = points["middle_tip"] + instant.rotation @ np.array([0.02, 0.0, 0.0])
    prior = uninformed_prior(posture_prior(ours.model))
    pose = Pose(instant.rotation.copy(), instant.position_m.copy(), prior.angles.copy())
    chains = hand_chains(ours.model)
    fit(chains, observe(ours.model, points), prior, pose, 60, _information())
    assert pose.angles[2, 0] == 0.0
