"""The first pose: wherever the hand is and however it is turned, never its mirror image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import angle_between
from rhot.hand import BASIC_LANDMARKS, HandModel, HandName
from services.solver.maths.chains import hand_chains
from services.solver.whole_hand.initialise import Hypothesis, initial_postures, initialise
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.priors.motion_prior import uninformed_prior
from services.solver.whole_hand.priors.posture_prior import posture_prior


def _initialise(model: HandModel, observations: Observations) -> Hypothesis:
    prior = uninformed_prior(posture_prior(model))
    return initialise(hand_chains(model), prior, observations)[0]


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("kind", ["random", "fist"])
def test_never_the_mirror_image(
    world: Callable, observe: Callable, hand: HandName, kind: str
) -> None:
    """Palm to or from the cameras, open or closed: within 45 deg, 8 on average (a mirror: 180)."""
    ours, rng, errors = world(hand), np.random.default_rng(1), []
    for seed in range(8):
        for instant in ours.motion(seed, 120, kind)[::24]:
            points = {
                name: p + rng.normal(0.0, 1e-3, 3) for name, p in ours.points(instant).items()
            }
            pose = _initialise(ours.model, observe(ours.model, points)).pose
            errors.append(np.rad2deg(angle_between(pose.rotation, instant.rotation)))
            assert np.linalg.norm(pose.position_m - instant.position_m) < 0.05
            assert np.all(pose.angles >= ours.model.limits_rad[..., 0])
            assert np.all(pose.angles <= ours.model.limits_rad[..., 1])
    assert max(errors) < 45.0
    assert np.mean(errors) < 8.0


def test_turning_the_world_turns_the_pose(world: Callable, observe: Callable) -> None:
    ours = world("right")
    a, b = ours.motion(3, 1)[0], ours.motion(4, 1)[0]
    moved = type(a)(b.rotation, b.position_m, a.angles_rad)
    first = _initialise(ours.model, observe(ours.model, ours.points(a))).pose
    second = _initialise(ours.model, observe(ours.model, ours.points(moved))).pose
    np.testing.assert_allclose(first.angles, second.angles, atol=2e-3)
    assert angle_between(first.rotation.T @ a.rotation, second.rotation.T @ b.rotation) < 2e-3


@pytest.mark.parametrize(
    "names", [("wrist", "index_tip", "middle_tip", "little_tip"), BASIC_LANDMARKS]
)
def test_absurd_landmarks_are_no_error(
    world: Callable, observe: Callable, names: tuple[str, ...]
) -> None:
    ours = world("right")
    low, high = ours.model.limits_rad[..., 0], ours.model.limits_rad[..., 1]
    for points in (
        {name: np.zeros(3) for name in names},
        {name: np.array([0.1 * i, 0.0, 0.0]) for i, name in enumerate(names)},
    ):
        cost, (R, t, q), _ = _initialise(ours.model, observe(ours.model, points))
        assert cost > 100.0
        assert np.all(np.isfinite(R))
        assert np.all(np.isfinite(t))
        assert np.all((q >= low) & (q <= high))
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)


def test_postures_are_within_limits(world: Callable) -> None:
    chains = hand_chains(world("left").model)
    for posture in initial_postures(chains):
        assert np.all(
            (posture >= chains.limits_rad[..., 0]) & (posture <= chains.limits_rad[..., 1])
        )
