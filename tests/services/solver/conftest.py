"""Helpers of the solver's tests: hands in motion, what cameras measure of them, random angles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
import pytest

from rhot.geometry.transforms import Array, rotation_from_quaternion, rotation_from_vector
from rhot.hand import (
    BASIC_LANDMARKS,
    HandModel,
    HandName,
    chain_forward,
    default_hand,
    forward,
    landmark_point,
)
from rhot.messages import HandPoint, HandPoints, HandPose
from services.solver.maths.chains import Chain
from services.solver.whole_hand.landmarks import (
    Observation,
    Observations,
    hand_landmarks,
    observation_arrays,
)

FRAME_NS = 33_333_333


@dataclass(frozen=True)
class Instant:
    """One instant of a moving hand."""

    rotation: Array
    position_m: Array
    angles_rad: Array


@dataclass(frozen=True)
class World:
    """A hand model and what can be asked of it."""

    model: HandModel

    def motion(self, seed: int, frames: int, kind: str = "random") -> list[Instant]:
        """Smooth motion: every joint on its own ("random") or a fist closing and opening ("fist").

        Fingers follow DIP = 2/3 PIP.
        """
        rng = np.random.default_rng(seed)
        low, high = self.model.limits_rad[..., 0], self.model.limits_rad[..., 1]
        if kind == "random":
            share = 0.5 + 0.45 * _waves(rng, frames, 20, 0.7).reshape(frames, 5, 4)
        else:
            closing = np.clip(0.5 + 0.6 * _waves(rng, frames, 1, 0.5)[:, :, None], 0.0, 1.0)
            share = np.repeat(np.repeat(0.92 * closing, 5, axis=1), 4, axis=2)
            share[:, :, 0] = 0.5
        angles = low + share * (high - low)
        angles[:, 1:, 3] = 2.0 / 3.0 * angles[:, 1:, 2]
        start = rotation_from_quaternion(rng.normal(size=4))
        turns, shifts = 0.8 * _waves(rng, frames, 3, 0.4), 0.1 * _waves(rng, frames, 3, 0.4)
        return [
            Instant(start @ rotation_from_vector(turn), np.array([0.0, 0.0, 0.5]) + shift, q)
            for turn, shift, q in zip(turns, shifts, angles, strict=True)
        ]

    def points(self, instant: Instant, names: Sequence[str] = BASIC_LANDMARKS) -> dict[str, Array]:
        """Where the landmarks of an instant are."""
        joints = forward(self.model, instant.rotation, instant.position_m, instant.angles_rad)
        return {name: landmark_point(self.model, name, *joints) for name in names}

    def message(
        self,
        places: dict[str, Array],
        frame: int,
        sigma_m: float = 1e-3,
        predicted: Sequence[str] = (),
    ) -> HandPoints:
        """The HandPoints of some landmarks, frame by frame at 30 Hz."""
        return HandPoints(
            hand=self.model.hand,
            seq=frame,
            stamp_ns=10**18 + frame * FRAME_NS,
            points=[
                HandPoint(
                    name=name,
                    position_m=tuple(np.asarray(place).tolist()),
                    sigma_m=(sigma_m,) * 3,
                    cameras=["left", "right"],
                    source="predicted" if name in predicted else "measured",
                )
                for name, place in places.items()
            ],
        )


def _waves(rng: np.random.Generator, frames: int, count: int, hz: float) -> Array:
    """Smooth curves within -1..1 at 30 frames a second; (frames, count)."""
    t = np.arange(frames)[:, None, None] / 30.0
    frequency, phase = rng.uniform(0.1, hz, (count, 3)), rng.uniform(0.0, 2.0 * np.pi, (count, 3))
    weight = rng.uniform(0.5, 1.0, (count, 3))
    return (weight * np.sin(2.0 * np.pi * frequency * t + phase)).sum(axis=2) / weight.sum(axis=1)


def _angles_of(pose: HandPose) -> Array:
    return np.array([finger.model_angles_rad for finger in pose.fingers])


@pytest.fixture(scope="session")
def world() -> Callable[[HandName], World]:
    """World of a hand of the tables that is known to be one: its model says nothing is unknown."""
    return lambda hand: World(msgspec.structs.replace(default_hand(hand), origin="simulated"))


@pytest.fixture(scope="session")
def angles_of() -> Callable[[HandPose], Array]:
    """(5, 4) angles of a pose message, in the order of DIGITS and DIGIT_ANGLES."""
    return _angles_of


@pytest.fixture(scope="session")
def observe() -> Callable[..., Observations]:
    """Points (rig frame) of a hand model, by landmark, as the arrays that the fit takes."""

    def make(model: HandModel, points: dict[str, Array], sigma_m: float = 1e-3) -> Observations:
        observed = {
            name: Observation(point, sigma_m**2 * np.eye(3), True) for name, point in points.items()
        }
        return observation_arrays(hand_landmarks(model), observed)

    return make


@pytest.fixture(scope="session")
def tip_pose() -> Callable[[Chain, Array], tuple[Array, Array]]:
    """The painted point (3,) and the last bone's axes (3, 3) of a chain at angles (4,).

    By the plain kinematics of rhot.hand, in the canonical frame.
    """

    def make(chain: Chain, q: Array) -> tuple[Array, Array]:
        positions, rotations = chain_forward(np.eye(3), np.zeros(3), chain.lengths, q)
        return positions[2] + rotations[2] @ chain.tool, rotations[2]

    return make


@pytest.fixture(scope="session")
def grasp() -> Callable[[np.random.Generator, bool], Array]:
    """A random 37-frame palmar grasp, as in the finger study: (37, 4); PIP leads, MCP follows.

    It starts as a hand does that is held open, bent by a few degrees, or straight; coupled: DIP =
    2/3 PIP.
    """

    def rise(t: Array, centre: float, width: float) -> Array:
        curve = 1.0 / (1.0 + np.exp(-(t - centre) / width))
        return (curve - curve[0]) / (curve[-1] - curve[0])

    def make(rng: np.random.Generator, coupled: bool = False, straight: bool = False) -> Array:
        t = np.linspace(0.0, 1.0, 37)
        q = np.zeros((37, 4))
        q[:, 0] = np.deg2rad(rng.uniform(-10.0, 10.0)) * (1.0 - t)
        q[:, 1] = np.deg2rad(rng.uniform(50.0, 88.0)) * rise(
            t, rng.uniform(0.4, 0.7), rng.uniform(0.1, 0.2)
        )
        q[:, 2] = np.deg2rad(rng.uniform(70.0, 108.0)) * rise(
            t, rng.uniform(0.2, 0.5), rng.uniform(0.15, 0.3)
        )
        q[:, 3] = np.deg2rad(rng.uniform(40.0, 85.0)) * rise(
            t, rng.uniform(0.2, 0.6), rng.uniform(0.15, 0.3)
        )
        if not straight:
            q[:, 1:] += np.linspace(1.0, 0.0, 37)[:, None] * np.deg2rad(
                rng.uniform((4.0, 6.0, 3.0), (10.0, 14.0, 9.0))
            )
        if coupled:
            q[:, 3] = 2.0 / 3.0 * q[:, 2]
        return q

    return make


@pytest.fixture(scope="session")
def within() -> Callable[[np.random.Generator, Array, bool], Array]:
    """Random angles (4,) within limits (4, 2).

    Coupled: DIP = 2/3 PIP, and PIP low enough for it.
    """

    def make(rng: np.random.Generator, limits: Array, coupled: bool) -> Array:
        q = rng.uniform(limits[:, 0], limits[:, 1])
        if coupled:
            q[2] = min(q[2], 1.5 * limits[3, 1])
            q[3] = 2.0 / 3.0 * q[2]
        return q

    return make
