"""The solver's step: messages in, messages out. Accuracy, honesty, determinism, every method."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import RigTable, Solver
from rhot.geometry.transforms import angle_between, rotation_from_quaternion
from rhot.hand import (
    BASIC_LANDMARKS,
    DIGITS,
    JOINTS,
    LANDMARKS,
    TIPS,
    HandName,
    default_hand,
    forward,
)
from rhot.messages import HandPose
from services.solver.step import SolverStep, restart_interval
from services.solver.whole_hand.hand_tracker import RESTART_INTERVAL

METHODS = ("dls", "fabrik", "analytic", "dls-paper", "fabrik-paper")
KNUCKLE = (*BASIC_LANDMARKS, "middle_proximal")


def _solver(hand: HandName = "right", method: str = "dls") -> SolverStep:
    model = msgspec.structs.replace(default_hand(hand), origin="simulated")
    return SolverStep(RigConfig(solver=Solver(method=method)), {hand: model})


def _run(
    ours, instants, names=BASIC_LANDMARKS, method: str = "dls", noise_m: float = 1e-3, seed: int = 0
) -> list[HandPose]:
    rng, step = np.random.default_rng(seed), _solver(ours.model.hand, method)
    poses = []
    for frame, instant in enumerate(instants):
        places = {
            name: p + rng.normal(0.0, noise_m, 3) for name, p in ours.points(instant, names).items()
        }
        poses.append(step.step(ours.message(places, frame)))
    return poses


def _errors(poses, instants, angles_of) -> tuple[float, float]:
    """Mean flexion error of the four fingers and mean orientation error, degrees."""
    flexion = [
        np.abs(angles_of(p) - i.angles_rad)[1:, 1:].mean()
        for p, i in zip(poses, instants, strict=True)
    ]
    turns = [
        angle_between(rotation_from_quaternion(p.wrist.orientation_wxyz), i.rotation)
        for p, i in zip(poses, instants, strict=True)
    ]
    return float(np.rad2deg(np.mean(flexion))), float(np.rad2deg(np.mean(turns)))


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize(
    ("names", "flexion_deg", "turn_deg"), [(BASIC_LANDMARKS, 5.5, 4.5), (KNUCKLE, 2.3, 1.7)]
)
def test_accuracy_at_one_millimetre(
    world: Callable,
    angles_of: Callable,
    hand: HandName,
    names: tuple,
    flexion_deg: float,
    turn_deg: float,
) -> None:
    """The issue's figures, over random motions and fists."""
    ours, results = world(hand), []
    for seed in range(3):
        for kind in ("random", "fist"):
            instants = ours.motion(seed, 150, kind)
            results.append(_errors(_run(ours, instants, names, seed=seed), instants, angles_of))
    assert np.mean([r[0] for r in results]) <= flexion_deg
    assert np.mean([r[1] for r in results]) <= turn_deg


def test_a_fist_closes_instead_of_turning(world: Callable, angles_of: Callable) -> None:
    """Wrist and tips alone would also fit a palm that turns.

    20 deg at worst while the prior let every finger bend on its own.
    """
    ours, turns, off = world("right"), [], []
    low, high = ours.model.limits_rad[..., 0], ours.model.limits_rad[..., 1]
    start, instants = ours.motion(10, 1)[0], []
    for share in np.concatenate(
        [np.full(5, 0.1), 0.51 - 0.41 * np.cos(np.linspace(0.0, 2.0 * np.pi, 90))]
    ):
        angles = low + share * (high - low)
        angles[:, 0], angles[1:, 3] = np.clip(0.0, low[:, 0], high[:, 0]), 2.0 / 3.0 * angles[1:, 2]
        instants.append(type(start)(start.rotation, start.position_m, angles))
    for pose, instant in zip(_run(ours, instants, noise_m=0.0), instants, strict=True):
        turns.append(
            angle_between(rotation_from_quaternion(pose.wrist.orientation_wxyz), instant.rotation)
        )
        off.append(np.abs(angles_of(pose) - instant.angles_rad)[1:, 1:3])
    assert np.rad2deg(max(turns)) < 8.0
    assert np.rad2deg(np.mean(off)) < 4.0


@pytest.mark.parametrize("method", METHODS)
def test_every_method_stays_in_the_limits_and_near_the_tips(
    world: Callable, angles_of: Callable, method: str
) -> None:
    ours = world("right")
    instants = ours.motion(5, 60)
    limits, gaps = ours.model.limits_rad, []
    for pose, instant in zip(_run(ours, instants, method=method), instants, strict=True):
        assert pose.method == method
        assert np.all((angles_of(pose) >= limits[..., 0]) & (angles_of(pose) <= limits[..., 1]))
        truth, _ = forward(ours.model, instant.rotation, instant.position_m, instant.angles_rad)
        gaps.extend(
            np.linalg.norm(
                np.array(pose.joints[JOINTS.index(tip)].position_m) - truth[JOINTS.index(tip)]
            )
            for tip in TIPS
        )
    assert np.sqrt(np.mean(np.square(gaps))) < (0.008 if method == "fabrik-paper" else 0.004)


def test_the_message(world: Callable, angles_of: Callable) -> None:
    ours = world("right")
    instants = ours.motion(6, 5)
    pose = _run(ours, instants)[-1]
    assert [joint.name for joint in pose.joints] == list(JOINTS)
    assert [finger.name for finger in pose.fingers] == list(DIGITS)
    assert {finger.status for finger in pose.fingers} == {"solved"}
    assert all(finger.iterations >= 0 and finger.residual_m < 3e-3 for finger in pose.fingers)
    assert {joint.name for joint in pose.joints if joint.source == "measured"} == set(
        BASIC_LANDMARKS
    )
    assert {joint.source for joint in pose.joints if joint.name not in BASIC_LANDMARKS} == {
        "solved"
    }
    # Joints are those of the hand model at the published wrist and angles.
    R, t = rotation_from_quaternion(pose.wrist.orientation_wxyz), np.array(pose.wrist.position_m)
    positions, _ = forward(ours.model, R, t, angles_of(pose))
    np.testing.assert_allclose([joint.position_m for joint in pose.joints], positions, atol=3e-6)
    assert pose.wrist.position_m == pose.joints[JOINTS.index("wrist")].position_m
    assert pose.fingers[0].angles_rad.pip == 0.0
    assert msgspec.json.decode(msgspec.json.encode(pose), type=HandPose) == pose


def test_the_same_input_gives_the_same_bytes(world: Callable) -> None:
    ours = world("right")
    instants = ours.motion(7, 40)
    once, again = (msgspec.json.encode(_run(ours, instants)) for _ in range(2))
    assert once == again


def test_left_and_right_mirror_each_other(world: Callable, angles_of: Callable) -> None:
    right, left = world("right"), world("left")
    mirror = np.diag([-1.0, 1.0, 1.0])
    instants = right.motion(8, 30)
    a, b = _solver("right"), _solver("left")
    for frame, instant in enumerate(instants):
        places = right.points(instant)
        here = a.step(right.message(places, frame))
        there = b.step(left.message({name: mirror @ p for name, p in places.items()}, frame))
        np.testing.assert_allclose(angles_of(there), angles_of(here), atol=2e-3)
        np.testing.assert_allclose(
            [j.position_m for j in there.joints],
            [j.position_m for j in here.joints] @ mirror,
            atol=2e-4,
        )


@pytest.mark.parametrize("method", ["dls", "fabrik"])
def test_turning_the_world_turns_the_pose(
    world: Callable, angles_of: Callable, method: str
) -> None:
    ours, rng = world("right"), np.random.default_rng(9)
    instants = ours.motion(9, 8)
    reference = _run(ours, instants, method=method, noise_m=0.0)[-1]
    for _ in range(10):
        R, t = rotation_from_quaternion(rng.normal(size=4)), rng.uniform(-0.3, 0.3, 3)
        moved = [type(i)(R @ i.rotation, R @ i.position_m + t, i.angles_rad) for i in instants]
        pose = _run(ours, moved, method=method, noise_m=0.0)[-1]
        np.testing.assert_allclose(angles_of(pose), angles_of(reference), atol=5e-3)


def test_none_until_found_and_for_hands_that_are_not_ours(world: Callable) -> None:
    ours, left, step = world("right"), world("left"), _solver()
    found = ours.points(ours.motion(10, 1)[0])
    assert step.step(ours.message({}, 0)) is None
    assert step.step(ours.message({name: found[name] for name in TIPS}, 1)) is None
    assert step.step(left.message(left.points(left.motion(10, 1)[0]), 2)) is None
    assert (
        step.step(ours.message({name: found[name] for name in ("wrist", *TIPS[:3])}, 3)) is not None
    )


def test_the_pose_says_how_sure_it_is(world: Callable, angles_of: Callable) -> None:
    """Errors in published standard deviations: about 1, over random motions.

    A hidden finger and a lost hand are less sure.
    """
    ours, turns, bends = world("right"), [], []
    instants = ours.motion(14, 150)
    for pose, instant in zip(_run(ours, instants), instants, strict=True):
        turn = angle_between(
            rotation_from_quaternion(pose.wrist.orientation_wxyz), instant.rotation
        )
        turns.append(turn / pose.wrist_sigma_rad)
        off = np.sqrt(np.mean(np.square(angles_of(pose) - instant.angles_rad), axis=1))
        bends.append(off[1:] / [finger.sigma_rad for finger in pose.fingers[1:]])
    assert 0.4 < np.sqrt(np.mean(np.square(turns))) < 1.6
    assert 0.4 < np.sqrt(np.mean(np.square(bends))) < 1.6
    step = _solver()
    places = ours.points(instants[0])
    seen = step.step(ours.message(places, 0))
    hidden = step.step(
        ours.message({name: p for name, p in places.items() if name != "ring_tip"}, 1)
    )
    lost = step.step(ours.message({}, 8))
    assert hidden.fingers[3].sigma_rad > 1.3 * seen.fingers[3].sigma_rad
    assert lost.wrist_sigma_rad > 1.5 * seen.wrist_sigma_rad
    assert lost.wrist_sigma_m > 10.0 * seen.wrist_sigma_m


def test_hidden_markers_are_predicted(world: Callable) -> None:
    ours, step = world("right"), _solver()
    for frame, instant in enumerate(ours.motion(11, 20)):
        places = ours.points(instant)
        if frame > 10:
            del places["ring_tip"]
        pose = step.step(ours.message(places, frame, predicted=["thumb_tip"] if frame > 10 else []))
    assert [finger.status for finger in pose.fingers] == [
        "predicted",
        "solved",
        "solved",
        "predicted",
        "solved",
    ]
    source = {joint.name: joint.source for joint in pose.joints}
    assert source["ring_tip"] == source["ring_distal"] == source["thumb_tip"] == "predicted"
    assert source["index_tip"] == source["wrist"] == "measured"
    assert source["index_distal"] == source["palm"] == "solved"
    pose = step.step(ours.message({}, 21))
    assert {joint.source for joint in pose.joints} == {"predicted"}
    assert {finger.status for finger in pose.fingers} == {"predicted"}


def test_a_tip_out_of_reach_says_so(world: Callable) -> None:
    ours, step = world("right"), _solver()
    instant = ours.motion(12, 1)[0]
    places = ours.points(instant, LANDMARKS)
    outwards = places["index_tip"] - places["index_proximal"]
    places["index_tip"] = places["index_proximal"] + 0.11 * outwards / np.linalg.norm(outwards)
    for frame in range(5):
        pose = step.step(ours.message(places, frame))
    assert pose.fingers[1].status == "unreachable"
    assert pose.fingers[1].residual_m > 0.01
    reached = np.array(pose.joints[JOINTS.index("index_tip")].position_m) - places["index_proximal"]
    assert reached @ outwards / np.linalg.norm(reached) / np.linalg.norm(outwards) > 0.9


def test_rigs_whose_hands_come_together_restart_at_times_of_their_own(world: Callable) -> None:
    """Restarts take 2 ms: of 32 rigs at once, poses would wait for a twentieth of a second."""
    rigs = [f"room{n}" for n in range(32)]
    intervals = np.array([restart_interval(f"{rig}/right") for rig in rigs])
    assert np.mean(intervals) == pytest.approx(RESTART_INTERVAL, rel=0.1)
    assert 0.8 * RESTART_INTERVAL <= intervals.min() <= intervals.max() <= 1.2 * RESTART_INTERVAL
    assert np.bincount(intervals).max() <= 3
    ours = world("right")
    steps = [
        SolverStep(RigConfig(rig=RigTable(name=rig)), {"right": ours.model}) for rig in rigs[:2]
    ]
    due: list[list[int]] = [[], []]
    for frame, instant in enumerate(ours.motion(12, round(1.5 * RESTART_INTERVAL))):
        for step, frames in zip(steps, due, strict=True):
            step.step(ours.message(ours.points(instant, LANDMARKS), frame))
            if step.challenge_due("right"):
                frames.append(frame)
    # Once as soon as each is found, and then so much later.
    assert [np.diff(frames)[-1] for frames in due] == intervals[:2].tolist()
