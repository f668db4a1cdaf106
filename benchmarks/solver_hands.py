"""Hands in motion and random goals for benchmarks/solver.py: what it measures the solver on.

Seeded, made of nothing but sines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_quaternion, rotation_from_vector
from rhot.hand import HandModel, forward, landmark_point
from rhot.messages import HandPoint, HandPoints
from services.solver.maths import kinematics as k

FRAMES, RATE_HZ = 150, 30.0


@dataclass(frozen=True)
class Motion:
    """A moving hand: wrist rotation (n, 3, 3) and position (n, 3) in the rig frame, angles (n, 5,
    4).
    """

    rotations: Array
    positions_m: Array
    angles_rad: Array


def waves(rng: np.random.Generator, count: int, low_hz: float, high_hz: float) -> Array:
    """Smooth curves within -1..1, three sines each; (FRAMES, count)."""
    t = np.arange(FRAMES)[:, None, None] / RATE_HZ
    frequency, phase = (
        rng.uniform(low_hz, high_hz, (count, 3)),
        rng.uniform(0.0, 2.0 * np.pi, (count, 3)),
    )
    weight = rng.uniform(0.5, 1.0, (count, 3))
    return (weight * np.sin(2.0 * np.pi * frequency * t + phase)).sum(axis=2) / weight.sum(axis=1)


def moving(model: HandModel, rng: np.random.Generator, kind: str) -> Motion:
    """Five seconds of a hand that turns by up to 50 deg and shifts by up to 12 cm, held in any
    orientation at all.

    "random": every joint wanders through its whole range on its own. "fist": digits close and open
    together, out of step by up to 8 %. Fingers follow DIP = 2/3 PIP, the thumb does not.
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


def anywhere(rng: np.random.Generator, chain: k.Chain, coupled: bool) -> Array:
    """Random angles (4,) within the limits; coupled: last flexion = ratio * second flexion."""
    q = rng.uniform(chain.limits[:, 0], chain.limits[:, 1])
    if coupled:
        q[2] = min(q[2], chain.limits[3, 1] / chain.coupling[0])
        q[3] = chain.coupling[0] * q[2]
    return q
