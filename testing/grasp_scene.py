"""A hand that takes a cup, carries it and puts it back, or passes beside it: the truth over time.

Fingers close at a constant rate until their skin touches, each in its own time, and open again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rhot.geometry.solids import Cylinder, capsule_distance
from rhot.geometry.transforms import Array, apply, inverse, rotation_from_vector, transform
from rhot.hand import HandModel, HandName, forward, joint_radii_m
from rhot.hand_skin import PARTS, skin_of
from testing.synthetic_hands import known_hand

# Open and closed, in degrees: thumb (abduction, cmc, mcp, dip), fingers (abduction, mcp, pip, dip).
_OPEN = np.deg2rad([[22, -18, 0, 0], [3, 8, 8, 5], [0, 8, 8, 5], [-2, 8, 8, 5], [-5, 8, 8, 5]])
_SHUT = np.deg2rad(
    [[22, 28, 50, 60], [1, 80, 95, 60], [0, 80, 95, 60], [-1, 80, 95, 60], [-2, 80, 95, 60]]
)
# A touch is one below this distance, in the truth.
_TOUCH_M = 0.0
# Seconds: the hand comes, closes, holds still, carries, puts back, opens, leaves.
_COME_S, _CLOSE_S, _STILL_S, _CARRY_S, _LEAVE_S = 0.8, 1.4, 0.3, 1.6, 0.8


@dataclass(frozen=True)
class Setting:
    """Which hand and cup, how large, and the seed; the hand passes beside at gap_m if > 0."""

    seed: int
    hand: HandName = "right"
    scale: float = 1.0
    diameter_m: float = 0.07
    height_m: float = 0.1
    gap_m: float = 0.0
    noise: float = 1.0
    fps: float = 30.0


@dataclass(frozen=True, eq=False)
class Instant:
    """The truth at one instant; metres, rig frame."""

    rotation: Array  # (3, 3) of the wrist
    position_m: Array  # (3,)
    angles_rad: Array  # (5, 4)
    T_rig_from_object: Array  # (4, 4)
    held: bool


class GraspScene:
    """One hand and one cup, as functions of time."""

    def __init__(self, setting: Setting) -> None:
        """Raises ValueError where that hand finds no place to hold that cup."""
        self.setting = setting
        self.model: HandModel = known_hand(setting.hand, setting.scale)
        self.solid = Cylinder(setting.diameter_m, setting.height_m)
        self._rng = np.random.default_rng([setting.seed, 17])
        self._radii = joint_radii_m(self.model)
        self.T_wrist_from_object, self._stop = self._place()
        rng = self._rng
        self._start = _COME_S + rng.uniform(0.0, 0.25, 5)
        self._opens = _COME_S + _CLOSE_S + _STILL_S + _CARRY_S + rng.uniform(0.1, 0.45, 5)
        self._rate = rng.uniform(0.5, 1.5, 5)
        self._view = rotation_from_vector(rng.normal(0.0, 0.5, 3))
        self._carry_m = rng.uniform(-1.0, 1.0, 3) * 0.08 + [0.0, 0.05, 0.0]
        self._carry_rad = rng.normal(0.0, 0.25, 3)
        self._base = transform(self._view, [0.0, 0.0, 0.5])
        self._side_m = self._passing() if setting.gap_m else np.zeros(3)

    @cached_property
    def seconds(self) -> float:
        """How long it takes."""
        return float(self._opens.max()) + 0.7 + _LEAVE_S

    def at(self, time_s: float) -> Instant:
        """All of it at one instant."""
        angles = self._angles(time_s)
        passing = self.setting.gap_m > 0.0
        carry = 0.0 if passing else self._carried(time_s)
        away = (
            1.0 - _smooth(time_s / _COME_S) + _smooth((time_s - self.seconds + _LEAVE_S) / _LEAVE_S)
        )
        moved = transform(rotation_from_vector(carry * self._carry_rad), carry * self._carry_m)
        held = not passing and self._opens.min() > time_s > float(self._closed_s.max())
        retreat = away * self._retreat_m
        if passing:
            share = time_s / self.seconds
            retreat = self._side_m + (share - 0.5) * self._sweep_m
        T_rig_from_wrist = self._base @ moved @ transform(np.eye(3), retreat)
        T_rig_from_object = self._base @ moved @ self.T_wrist_from_object
        return Instant(
            T_rig_from_wrist[:3, :3], T_rig_from_wrist[:3, 3], angles, T_rig_from_object, held
        )

    @property
    def _retreat_m(self) -> Array:
        """Out of the hand: the hand leaves a cup backwards, its back first."""
        return np.array([0.0, 0.12, 0.06])

    @property
    def _sweep_m(self) -> Array:
        return np.array([0.25, 0.0, 0.0])

    @cached_property
    def _closed_s(self) -> Array:
        return self._start + self._stop / self._rate

    def _angles(self, time_s: float) -> Array:
        if self.setting.gap_m:
            return _OPEN + 0.35 * (_SHUT - _OPEN)
        share = np.minimum((time_s - self._start) * self._rate, self._stop)
        opened = self._stop - (time_s - self._opens) * self._rate
        share = np.clip(np.minimum(share, opened), 0.0, 1.0)
        return _OPEN + share[:, None] * (_SHUT - _OPEN)

    def _carried(self, time_s: float) -> float:
        start = _COME_S + _CLOSE_S + _STILL_S
        return _smooth((time_s - start) / (0.5 * _CARRY_S)) - _smooth(
            (time_s - start - 0.5 * _CARRY_S) / (0.5 * _CARRY_S)
        )

    def distances(self, instant: Instant) -> Array:
        """(6,) of PARTS, from skin to cup."""
        T = inverse(transform(instant.rotation, instant.position_m)) @ instant.T_rig_from_object
        return self._part_distances(T, instant.angles_rad)

    def _part_distances(self, T_wrist_from_object: Array, angles: Array) -> Array:
        joints = forward(self.model, np.eye(3), np.zeros(3), angles)
        skin = skin_of(*joints, self._radii, self.model.side)
        ends = apply(inverse(T_wrist_from_object), skin.ends_m)
        found = capsule_distance(self.solid, ends, skin.radii_m).distance_m
        return np.array([found[skin.part == row].min() for row in range(len(PARTS))])

    def _place(self) -> tuple[Array, Array]:
        """Where in the hand the cup is held, and how far each finger closes until it touches."""
        rng, side = self._rng, self.model.side
        shares = np.linspace(0.0, 1.0, 26)
        for _ in range(400):
            middle = np.array([side * rng.normal(-0.02, 0.012), -0.03, -0.085])
            middle[1] -= 0.5 * self.setting.diameter_m + rng.uniform(-0.012, 0.02)
            middle *= [1.0, 1.0, self.setting.scale]
            middle[2] += rng.normal(0.0, 0.008)
            # The cup's axis (y) lies across the palm.
            tilt = rotation_from_vector(rng.normal(0.0, 0.15, 3))
            T = transform(tilt @ rotation_from_vector([0.0, 0.0, np.pi / 2]), middle)
            table = np.array(
                [self._part_distances(T, _OPEN + s * (_SHUT - _OPEN)) for s in shares]
            )  # (26, 6)
            if table[0, :5].min() < 0.004 or table[:, 5].min() < 0.0005:
                continue
            below = table[:, :5] < _TOUCH_M
            if not below.any(axis=0).all():
                continue
            stops = np.array(
                [self._stop_at(T, row, shares[k]) for row, k in enumerate(below.argmax(axis=0))]
            )
            if self._opposed(T, stops):
                return T, stops
        raise ValueError(f"no grasp found for {self.setting}")

    def _opposed(self, T_wrist_from_object: Array, stops: Array) -> bool:
        """Whether the thumb presses against a finger: both within 45 deg of the line between."""
        angles = _OPEN + stops[:, None] * (_SHUT - _OPEN)
        joints = forward(self.model, np.eye(3), np.zeros(3), angles)
        skin = skin_of(*joints, self._radii, self.model.side)
        ends = apply(inverse(T_wrist_from_object), skin.ends_m[:5])
        found = capsule_distance(self.solid, ends, skin.radii_m[:5])
        line = found.point_m[1:] - found.point_m[0]
        line /= np.linalg.norm(line, axis=1, keepdims=True)
        cosines = np.minimum(-line @ found.normal[0], np.einsum("fk,fk->f", line, found.normal[1:]))
        return bool(cosines.max() > np.cos(np.deg2rad(45.0)))

    def _stop_at(self, T: Array, row: int, high: float) -> float:
        low = high - 1.0 / 25.0
        for _ in range(20):
            middle = 0.5 * (low + high)
            gap = self._part_distances(T, _OPEN + middle * (_SHUT - _OPEN))[row]
            low, high = (middle, high) if gap > _TOUCH_M else (low, middle)
        return high

    def _passing(self) -> Array:
        """How far the hand is shifted, so that it passes at just gap_m."""
        away, low, high = np.array([0.0, 1.0, 0.3]), -0.1, 0.25
        for _ in range(24):
            self._side_m = 0.5 * (low + high) * away
            nearest = min(
                float(self.distances(self.at(t)).min()) for t in np.linspace(0, self.seconds, 60)
            )
            low, high = (
                (low, 0.5 * (low + high))
                if nearest > self.setting.gap_m
                else (0.5 * (low + high), high)
            )
        return high * away


def _smooth(u: float) -> float:
    u = min(1.0, max(0.0, u))
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))
