"""Poses of hands that were never measured: how sure they are, and what the maths rests on."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, angle_between, rotation_from_quaternion
from rhot.hand import HandModel, default_hand, forward, landmark_point
from rhot.messages import HandPose
from services.solver.maths.chains import hand_chains
from services.solver.model_error import ModelError
from services.solver.step import SolverStep
from services.solver.whole_hand.hand_tracker import HandEstimate
from services.solver.whole_hand.landmarks import Observation, hand_landmarks, observation_arrays
from testing.synthetic_hands import with_bone_factors

NAMES = ("wrist", "thumb_tip", "index_tip", "little_tip", "middle_proximal")


def other_hand(seed: int) -> HandModel:
    """A hand whose bones differ from the tables' by up to a tenth, painted as one does."""
    random = np.random.default_rng([seed, 3])
    model = with_bone_factors(default_hand(), random.uniform(0.9, 1.1, (5, 4)))
    paint = {}
    for name, dab in model.paint.items():
        x, y, z = dab.offset_m
        off = random.uniform(-1.0, 1.0, 2)
        place = (
            (x, y, z + 0.003 * off[0])
            if name.endswith("_tip")
            else (x + 0.005 * off[0], y, z + 0.005 * off[1])
        )
        paint[name] = msgspec.structs.replace(dab, offset_m=tuple(map(float, place)))
    return msgspec.structs.replace(model, paint=paint)


def ratios(
    world: Callable, angles_of: Callable, seed: int, told: HandModel, true: HandModel
) -> tuple[Array, float]:
    """Squared errors over variances of wrist, orientation and fingers, and the fingers' error."""
    ours = type(world("right"))(true)
    step, errors, variances = SolverStep(RigConfig(), {"right": told}), [], []
    random = np.random.default_rng(seed)
    for frame, instant in enumerate(ours.motion(seed, 120, "fist" if seed % 2 else "random")):
        places = {n: p + random.normal(0.0, 1e-3, 3) for n, p in ours.points(instant).items()}
        pose: HandPose | None = step.step(ours.message(places, frame))
        assert pose is not None
        turned = rotation_from_quaternion(pose.wrist.orientation_wxyz)
        bends = (angles_of(pose) - instant.angles_rad)[1:]
        errors.append(
            [
                np.sum((np.array(pose.wrist.position_m) - instant.position_m) ** 2),
                angle_between(turned, instant.rotation) ** 2,
                np.mean(bends**2),
            ]
        )
        fingers = np.mean([finger.sigma_rad**2 for finger in pose.fingers[1:]])
        variances.append([pose.wrist_sigma_m**2, pose.wrist_sigma_rad**2, fingers])
    means = np.mean(errors, axis=0)
    return means / np.mean(variances, axis=0), float(np.sqrt(means[2]))


def test_sigmas_cover_the_errors_of_hands_that_were_never_measured(
    world: Callable, angles_of: Callable
) -> None:
    """And a model that claims to know them, which these hands are not, would not."""
    table, seeds = default_hand(), (21, 22, 23, 24)
    sure = msgspec.structs.replace(table, origin="simulated")
    honest = [ratios(world, angles_of, seed, table, other_hand(seed)) for seed in seeds]
    claimed = [ratios(world, angles_of, seed, sure, other_hand(seed)) for seed in seeds]
    mean = np.mean([ratio for ratio, _ in honest], axis=0)
    assert np.all(mean < 2.0)
    assert np.all(mean > 0.05)
    assert np.all(np.mean([ratio for ratio, _ in claimed], axis=0) > 2.0 * mean)
    # And the fit that is told how well the model knows its landmarks is the better one.
    assert np.mean([off for _, off in honest]) < np.mean([off for _, off in claimed])


def test_an_exact_hand_has_small_sigmas(world: Callable, angles_of: Callable) -> None:
    table = default_hand()
    sure = msgspec.structs.replace(table, origin="simulated")
    found = [ratios(world, angles_of, seed, sure, table)[0] for seed in (21, 22, 23, 24)]
    mean = np.mean(found, axis=0)
    assert np.all((mean > 0.15) & (mean < 2.0))


def test_a_pose_tells_how_badly_its_hand_fits_the_model(world: Callable) -> None:
    """Nothing of one that was measured, whose bones are no question."""
    table = default_hand()
    random = np.random.default_rng(5)
    other = with_bone_factors(table, random.choice([0.75, 1.3], (5, 4)))
    measured = msgspec.structs.replace(table, origin="measured")
    found = []
    for told, true in ((table, table), (table, other), (measured, other)):
        ours, step = type(world("right"))(true), SolverStep(RigConfig(), {"right": told})
        for frame, instant in enumerate(ours.motion(5, 120, "random")):
            pose = step.step(ours.message(ours.points(instant), frame))
        assert pose is not None
        found.append(pose.model_misfit)
    alike, unlike, untold = found
    assert alike < 0.9
    assert unlike > 1.2
    assert untold is None


@pytest.mark.parametrize("error", ["size", "bone", "root", "paint"])
def test_a_constant_error_of_the_model_moves_the_pose_as_is_told(
    world: Callable, error: str
) -> None:
    """One error at a time in a hand at rest, tracked until nothing moves any more.

    Its effect on the wrist is among what the covariance holds: within the sigma along its own
    direction, had the model only this error.
    """
    table = default_hand()
    true = changed(table, error)
    ours, step = type(world("right"))(true), SolverStep(RigConfig(), {"right": table})
    known = SolverStep(RigConfig(), {"right": true})
    instant = ours.motion(14, 1)[0]
    for frame in range(40):
        message = ours.message(ours.points(instant), frame)
        pose, exact = step.step(message), known.step(message)
    moved = np.array(pose.wrist.position_m) - np.array(exact.wrist.position_m)
    assert np.linalg.norm(moved) < 2.0 * pose.wrist_sigma_m
    assert pose.wrist_sigma_m < 0.03


def changed(model: HandModel, error: str) -> HandModel:
    """The model with one error of two of its standard deviations."""
    if error == "size":
        return default_hand("right", 1.1)
    if error == "paint":
        dab = model.paint["wrist"]
        x, y, z = dab.offset_m
        moved = msgspec.structs.replace(dab, offset_m=(x + 0.006, y, z))
        return msgspec.structs.replace(model, paint={**model.paint, "wrist": moved})
    factors = np.ones((5, 4))
    factors[1, 0 if error == "bone" else 3] = 1.12 if error == "bone" else 1.08
    return with_bone_factors(model, factors)


def test_what_a_pose_forgets_and_what_it_starts_with(world: Callable) -> None:
    """After a gap, and after stamps that run backwards, nothing old is left."""
    model = default_hand()
    chains, landmarks = hand_chains(model), hand_landmarks(model)
    joints = forward(model, np.eye(3), np.array([0.0, 0.0, 0.5]), np.full((5, 4), 0.2))
    observed = {
        name: Observation(landmark_point(model, name, *joints), 2.5e-5 * np.eye(3), True)
        for name in NAMES
    }
    estimate = HandEstimate(
        np.eye(3), np.array([0.0, 0.0, 0.5]), np.full((5, 4), 0.2), 1e-4 * np.eye(26), 1.0, 3
    )
    told = tuple(observed), observation_arrays(landmarks, observed)
    errors = ModelError(model, chains)
    first = errors.pose_variances(10**18, estimate, *told)
    assert np.all(first > 0.0)
    later = errors.pose_variances(10**18 + 33_000_000, estimate, *told)
    assert np.abs(later - first).max() > 1e-7
    for stamp_ns in (10**18 + 5 * 10**9, 10**18 + 2 * 10**9):
        np.testing.assert_allclose(errors.pose_variances(stamp_ns, estimate, *told), first)
    # Without a landmark nothing is added to what is known, and nothing breaks.
    errors = ModelError(model, chains)
    nothing = errors.pose_variances(10**18, estimate, (), observation_arrays(landmarks, {}))
    np.testing.assert_allclose(nothing, 0.5 * estimate.covariance.diagonal())


def test_a_covariance_wider_than_its_landmarks_leave_makes_no_error_grow() -> None:
    """As with a rival's share, or landmarks that the fit weighed down: for minutes on end."""
    model = default_hand()
    chains, landmarks = hand_chains(model), hand_landmarks(model)
    joints = forward(model, np.eye(3), np.array([0.0, 0.0, 0.5]), np.full((5, 4), 0.2))
    observed = {
        name: Observation(landmark_point(model, name, *joints), 1e-6 * np.eye(3), True)
        for name in NAMES
    }
    told = tuple(observed), observation_arrays(landmarks, observed)
    place = np.array([0.0, 0.0, 0.5])
    estimate = HandEstimate(np.eye(3), place, np.full((5, 4), 0.2), 1e-2 * np.eye(26), 1.0, 3)
    errors = ModelError(model, chains)
    variances = [
        errors.pose_variances(10**18 + 16_000_000 * frame, estimate, *told) for frame in range(5000)
    ]
    # No part of the pose is moved by more than the landmarks' own errors can: centimetres, a turn.
    added = np.array(variances) - 0.5 * estimate.covariance.diagonal()
    assert np.all((added >= 0.0) & (added < 1.0))
    assert added[:, 3:6].max() < 0.05**2


def test_a_hand_that_fits_is_surer_than_one_that_does_not() -> None:
    """By what fits of some seconds leave of the landmarks, between a fourth and nine times; no
    longer than the hand is followed. What a wrong size does stays: it leaves nothing.
    """
    model = default_hand()
    chains, landmarks = hand_chains(model), hand_landmarks(model)
    joints = forward(model, np.eye(3), np.array([0.0, 0.0, 0.5]), np.full((5, 4), 0.2))
    random, place = np.random.default_rng(6), np.array([0.0, 0.0, 0.5])
    estimate = HandEstimate(np.eye(3), place, np.full((5, 4), 0.2), 1e-6 * np.eye(26), 1.0, 3)
    found = []
    for off_m in (0.0, 0.006, 0.1):
        errors = ModelError(model, chains)
        away = {name: random.normal(size=3) for name in NAMES}
        observed = {
            name: Observation(
                landmark_point(model, name, *joints)
                + off_m * away[name] / np.linalg.norm(away[name]),
                2.6e-5 * np.eye(3),
                True,
            )
            for name in NAMES
        }
        told = tuple(observed), observation_arrays(landmarks, observed)
        first = errors.pose_variances(10**18, estimate, *told)
        for frame in range(1, 500):
            last = errors.pose_variances(10**18 + 33_000_000 * frame, estimate, *told)
        begun = errors.pose_variances(10**18 + 60 * 10**9, estimate, *told)
        np.testing.assert_allclose(begun, first)
        found.append(last)
    fits, misses, nothing = found
    angles = slice(6, None)
    assert np.all(fits <= misses)
    assert np.all(fits[angles] < 0.6 * misses[angles])
    ratio = nothing / fits
    assert np.all(ratio < 36.1)
    assert np.median(ratio[angles]) > 20.0


def test_landmarks_are_known_no_better_than_where_they_sit() -> None:
    for origin, at_least_m in (("tables", 4e-3), ("measured", 1.2e-3), ("simulated", 1e-3)):
        model = msgspec.structs.replace(default_hand(), origin=origin)
        errors = ModelError(model, hand_chains(model))
        sigma_m = math.sqrt(1e-6 + errors.landmark_m2)
        assert 0.999 * at_least_m <= sigma_m < 1.5 * at_least_m
