"""Hands in motion and random goals for the solver's benchmarks, and how far off its poses are.

Seeded, made of nothing but sines.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.transforms import (
    Array,
    angle_between,
    rotation_from_quaternion,
    rotation_from_vector,
)
from rhot.hand import (
    BASIC_LANDMARKS,
    HANDS,
    HandModel,
    chain_forward,
    forward,
    landmark_point,
)
from rhot.messages import HandPoint, HandPoints
from services.solver.maths.chains import Chain, digit_chain, hand_chains
from services.solver.step import SolverStep
from testing.synthetic_hands import known_hand

MODEL = known_hand()
CHAINS = hand_chains(MODEL)
INDEX = digit_chain(CHAINS, 1)
FRAMES, RATE_HZ = 150, 30.0


@dataclass(frozen=True)
class Motion:
    """A moving hand.

    Wrist rotation (n, 3, 3) and position (n, 3) in the rig frame, angles (n, 5, 4).
    """

    rotations: Array
    positions_m: Array
    angles_rad: Array


def waves(rng: np.random.Generator, count: int, low_hz: float, high_hz: float) -> Array:
    """Smooth curves within -1..1, three sines each; (FRAMES, count)."""
    t = np.arange(FRAMES)[:, None, None] / RATE_HZ
    frequency = rng.uniform(low_hz, high_hz, (count, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (count, 3))
    weight = rng.uniform(0.5, 1.0, (count, 3))
    return (weight * np.sin(2.0 * np.pi * frequency * t + phase)).sum(axis=2) / weight.sum(axis=1)


def moving(model: HandModel, rng: np.random.Generator, kind: str) -> Motion:
    """Five seconds of a hand that turns by up to 50 deg and shifts by up to 12 cm.

    Held in any orientation at all. "random": every joint wanders through its whole range on its
    own. "fist": digits close and open together, out of step by up to 8 %. Fingers follow DIP = 2/3
    PIP, the thumb does not.
    """
    low, high = model.limits_rad[..., 0], model.limits_rad[..., 1]
    if kind == "random":
        share = 0.5 + 0.5 * np.clip(1.5 * waves(rng, 20, 0.15, 0.8), -1.0, 1.0).reshape(
            FRAMES, 5, 4
        )
    else:
        closing = np.clip(0.5 + 0.7 * waves(rng, 1, 0.15, 0.8), 0.0, 1.0)
        share = np.empty((FRAMES, 5, 4))
        for row in range(5):
            own = np.clip(closing[:, 0] + rng.uniform(-0.08, 0.08), 0.0, 1.0)
            # PIP leads, MCP follows, as in the finger study's figure 5.
            share[:, row] = rng.uniform(0.75, 1.0, 4) * own[:, None] ** np.array(
                [1.0, 1.6, 0.9, 1.0]
            )
            share[:, row, 0] = 0.5 + 0.3 * waves(rng, 1, 0.15, 0.8)[:, 0] * (1.0 - own)
    angles = low + share * (high - low)
    angles[:, 1:, 3] = 2.0 / 3.0 * angles[:, 1:, 2]
    start = rotation_from_quaternion(rng.normal(size=4))
    turns, shifts = 0.9 * waves(rng, 3, 0.1, 0.5), 0.12 * waves(rng, 3, 0.1, 0.5)
    return Motion(
        np.array([start @ rotation_from_vector(turn) for turn in turns]),
        np.array([0.0, 0.0, 0.5]) + shifts,
        angles,
    )


def messages(
    model: HandModel, motion: Motion, names: Sequence[str], rng: np.random.Generator, noise_m: float
) -> list[HandPoints]:
    """What fusion would send of it, with white noise on every coordinate."""
    result = []
    for frame in range(FRAMES):
        joints = forward(
            model, motion.rotations[frame], motion.positions_m[frame], motion.angles_rad[frame]
        )
        # Alike in calibrate_hand.py, whose messages have cameras and a rate of their own.
        points = [
            HandPoint(
                name=name,
                position_m=tuple(
                    (landmark_point(model, name, *joints) + rng.normal(0.0, noise_m, 3)).tolist()
                ),
                sigma_m=(noise_m,) * 3,
                cameras=[],
                source="measured",
            )
            for name in names
        ]
        result.append(
            HandPoints(
                hand=model.hand, seq=frame, stamp_ns=int(1e9 * frame / RATE_HZ), points=points
            )
        )
    return result


def grasp(rng: np.random.Generator, straight: bool = False, coupled: bool = False) -> Array:
    """A random palmar grasp of 37 frames, as in the finger study; (37, 4) rad.

    It starts slightly bent, or straight.
    """

    def rise(centre: float, width: float) -> Array:
        curve = 1.0 / (1.0 + np.exp(-(np.linspace(0.0, 1.0, 37) - centre) / width))
        return (curve - curve[0]) / (curve[-1] - curve[0])

    down, q = np.linspace(1.0, 0.0, 37), np.zeros((37, 4))
    q[:, 0] = np.deg2rad(rng.uniform(-10.0, 10.0)) * down
    q[:, 1] = np.deg2rad(rng.uniform(50.0, 88.0)) * rise(
        rng.uniform(0.4, 0.7), rng.uniform(0.1, 0.2)
    )
    q[:, 2] = np.deg2rad(rng.uniform(70.0, 108.0)) * rise(
        rng.uniform(0.2, 0.5), rng.uniform(0.15, 0.3)
    )
    q[:, 3] = np.deg2rad(rng.uniform(40.0, 85.0)) * rise(
        rng.uniform(0.2, 0.6), rng.uniform(0.15, 0.3)
    )
    if not straight:
        q[:, 1:] += down[:, None] * np.deg2rad(rng.uniform((4.0, 6.0, 3.0), (10.0, 14.0, 9.0)))
    if coupled:
        q[:, 3] = 2.0 / 3.0 * q[:, 2]
    return q


def tip_pose(chain: Chain, q: Array) -> tuple[Array, Array]:
    """The painted point (3,) and the last bone's axes (3, 3), canonical frame, at angles q (4,)."""
    positions, rotations = chain_forward(np.eye(3), np.zeros(3), chain.lengths, q)
    return positions[2] + rotations[2] @ chain.tool, rotations[2]


def anywhere(rng: np.random.Generator, chain: Chain, coupled: bool) -> Array:
    """Random angles (4,) within the limits; coupled: last flexion = ratio * second flexion."""
    q = rng.uniform(chain.limits[:, 0], chain.limits[:, 1])
    if coupled:
        q[2] = min(q[2], chain.limits[3, 1] / chain.coupling[0])
        q[3] = chain.coupling[0] * q[2]
    return q


def with_painted(extra: Sequence[str], seeds: int) -> tuple[float, float, float, float]:
    """Mean errors over random motions and fists, right and left hands, 1 mm of noise.

    extra: painted beside wrist and tips.
    """
    rows = []
    for seed, kind, hand in itertools.product(range(seeds), ("random", "fist"), HANDS):
        model = known_hand(hand)
        rng = np.random.default_rng([seed, kind == "fist", hand == "left"])
        rows.append(errors_of(model, moving(model, rng, kind), (*BASIC_LANDMARKS, *extra), rng))
    flexion, turn, thumb, abduction = np.mean(rows, axis=0).tolist()
    return flexion, turn, thumb, abduction


def errors_of(
    model: HandModel,
    motion: Motion,
    names: Sequence[str],
    rng: np.random.Generator,
    painted: HandModel | None = None,
) -> tuple[float, float, float, float]:
    """Mean errors of one motion, degrees: (flexion, orientation, thumb, abduction).

    Flexion and abduction are the fingers'. painted: the hand as it is, where it differs from the
    model of it. The first 5 frames are left out.
    """
    step, rows = SolverStep(RigConfig(), {model.hand: model}), []
    for frame, line in enumerate(messages(painted or model, motion, names, rng, 1e-3)):
        pose = step.step(line)
        if pose is not None and frame >= 5:
            angles = np.array([finger.model_angles_rad for finger in pose.fingers])
            off = np.abs(angles - motion.angles_rad[frame])
            rotation = rotation_from_quaternion(pose.wrist.orientation_wxyz)
            turn = angle_between(rotation, motion.rotations[frame])
            rows.append((off[1:, 1:].mean(), turn, off[0].mean(), off[[1, 3, 4], 0].mean()))
    flexion, turn, thumb, abduction = np.rad2deg(np.mean(rows, axis=0)).tolist()
    return flexion, turn, thumb, abduction
