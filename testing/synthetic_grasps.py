"""Hands that take cups, carry them and put them back, or pass beside them: as truth, and as what
solver and object tracker make of noisy points.

Fingers close at a constant rate until their skin touches, each in its own time, and open again. The
landmarks' errors are as rendered hands show them: less across the view than in depth, part of it
common to all, part lasting, part white; the hand is then solved by the solver itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.solids import Cylinder, capsule_distance
from rhot.geometry.transforms import (
    Array,
    apply,
    inverse,
    quaternion_from_rotation,
    rotation_from_vector,
    transform,
)
from rhot.hand import (
    BASIC_LANDMARKS,
    HandModel,
    HandName,
    forward,
    joint_radii_m,
    landmark_point,
)
from rhot.hand_skin import PARTS, skin_of
from rhot.messages import FingerAngles, HandPoint, HandPoints, HandPose, WristPose
from rhot.messages.objects import ObjectPose
from rhot.messages.simulator import HandTruth, ObjectTruth, Truth
from services.solver.step import SolverStep
from testing.synthetic_hands import known_hand

START_NS = 10**18
# Open and closed, in degrees: thumb (abduction, cmc, mcp, dip), fingers (abduction, mcp, pip, dip).
_OPEN = np.deg2rad([[22, -18, 0, 0], [3, 8, 8, 5], [0, 8, 8, 5], [-2, 8, 8, 5], [-5, 8, 8, 5]])
_SHUT = np.deg2rad(
    [[22, 28, 50, 60], [1, 80, 95, 60], [0, 80, 95, 60], [-1, 80, 95, 60], [-2, 80, 95, 60]]
)
# Of the landmarks, one standard deviation across the view and along it. Rendered hands at half a
# metre ("grab" and "fist" of the simulator) leave 0.4 and 1.2 mm at the tips.
_ACROSS_M, _DEPTH_M = 0.0005, 0.0013
# Shares of the variance: common to the whole hand, and how it lasts (for good, 0.15 s, white).
_COMMON, _LASTING, _SLOW = 0.35, 0.3, 0.4
_SLOW_S = 0.15
# Of an object tracker's pose behind its filter: across 1 mm and 0.3 deg in all.
_OBJECT_M, _OBJECT_RAD = 1e-3 / np.sqrt(3.0), np.deg2rad(0.3) / np.sqrt(3.0)
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


@dataclass(frozen=True)
class Recording:
    """A scene as the services would see it: objects' and hands' poses by stamp, and the truth."""

    objects: list[ObjectPose] = field(default_factory=list)
    hands: list[HandPose] = field(default_factory=list)
    truth: list[Truth] = field(default_factory=list)

    def merged(self, object_delay_ns: int = 0) -> Iterator[ObjectPose | HandPose]:
        """All poses as they arrive, the objects' later by a delay."""
        keyed = [(one.stamp_ns + object_delay_ns, 0, n) for n, one in enumerate(self.objects)]
        keyed += [(one.stamp_ns, 1, n) for n, one in enumerate(self.hands)]
        for _, kind, n in sorted(keyed):
            yield self.hands[n] if kind else self.objects[n]


def record(scene: GraspScene) -> Recording:
    """Solve the scene's hand from noisy points; the same scene gives the same recording."""
    setting = scene.setting
    rng = np.random.default_rng([setting.seed, 23])
    solver = SolverStep(RigConfig(), {setting.hand: scene.model})
    recording = Recording()
    stamps = START_NS + np.round(np.arange(0.0, scene.seconds, 1.0 / setting.fps) * 1e9)
    errors = landmark_errors(rng, len(stamps), 1.0 / setting.fps) * setting.noise
    for frame, stamp in enumerate(stamps.astype(np.int64).tolist()):
        instant = scene.at((stamp - START_NS) * 1e-9)
        points = _points(scene.model, instant, errors[frame], frame, stamp)
        pose = solver.step(points)
        if pose is not None:
            recording.hands.append(pose)
        recording.truth.append(_truth(scene, instant, stamp))
    for seq, time_s in enumerate(np.arange(0.0, scene.seconds, 1.0 / 90.0).tolist()):
        recording.objects.append(_object(scene, rng, seq, time_s))
    return recording


def landmark_errors(rng: np.random.Generator, frames: int, frame_s: float) -> Array:
    """(frames, 6, 3) metres, z along the view."""
    keep = np.exp(-frame_s / _SLOW_S)
    total = np.zeros((frames, 6, 3))
    for share, count in ((_COMMON, 1), (1.0 - _COMMON, 6)):
        lasting = rng.normal(size=(count, 3))
        slow = rng.normal(size=(count, 3))
        for frame in range(frames):
            slow = keep * slow + np.sqrt(1.0 - keep * keep) * rng.normal(size=(count, 3))
            mixed = np.sqrt(_LASTING) * lasting + np.sqrt(_SLOW) * slow
            mixed = mixed + np.sqrt(1.0 - _LASTING - _SLOW) * rng.normal(size=(count, 3))
            total[frame] += np.sqrt(share) * mixed
    return total * [_ACROSS_M, _ACROSS_M, _DEPTH_M]


def _points(
    model: HandModel, instant: Instant, errors: Array, frame: int, stamp_ns: int
) -> HandPoints:
    joints = forward(model, instant.rotation, instant.position_m, instant.angles_rad)
    points = [
        HandPoint(
            name=name,
            position_m=tuple((landmark_point(model, name, *joints) + error).tolist()),
            sigma_m=(_ACROSS_M, _ACROSS_M, _DEPTH_M),
            cameras=["left", "right"],
            source="measured",
        )
        for name, error in zip(BASIC_LANDMARKS, errors, strict=True)
    ]
    return HandPoints(hand=model.hand, seq=frame, stamp_ns=stamp_ns, points=points)


def _object(scene: GraspScene, rng: np.random.Generator, seq: int, time_s: float) -> ObjectPose:
    T, step_s = scene.at(time_s).T_rig_from_object, 1e-3
    after = scene.at(time_s + step_s).T_rig_from_object
    R = rotation_from_vector(rng.normal(0.0, _OBJECT_RAD, 3)) @ T[:3, :3]
    return ObjectPose(
        object="cup",
        serial="LHR-1",
        seq=seq,
        stamp_ns=START_NS + round(time_s * 1e9),
        position_m=tuple((T[:3, 3] + rng.normal(0.0, _OBJECT_M, 3)).tolist()),
        orientation_wxyz=tuple(quaternion_from_rotation(R).tolist()),
        velocity_m_s=tuple(((after - T)[:3, 3] / step_s).tolist()),
        angular_velocity_rad_s=(0.0, 0.0, 0.0),
        tracking="ok",
        registered=True,
    )


def _truth(scene: GraspScene, instant: Instant, stamp_ns: int) -> Truth:
    gaps = scene.distances(instant)
    hand = scene.setting.hand
    T = instant.T_rig_from_object
    wrist = WristPose(
        position_m=tuple(instant.position_m.tolist()),
        orientation_wxyz=tuple(quaternion_from_rotation(instant.rotation).tolist()),
    )
    cup = ObjectTruth(
        position_m=tuple(T[:3, 3].tolist()),
        orientation_wxyz=tuple(quaternion_from_rotation(T[:3, :3]).tolist()),
        contacts={f"{hand}.{part}": float(gap) for part, gap in zip(PARTS, gaps, strict=True)},
        held_by=hand if instant.held else "",
    )
    none = FingerAngles(abduction=0.0, mcp=0.0, pip=0.0, dip=0.0)
    return Truth(
        stamp_ns=stamp_ns,
        hands={hand: HandTruth(points_m={}, wrist=wrist, angles_rad={"index": none})},
        objects={"cup": cup},
    )


def _smooth(u: float) -> float:
    u = min(1.0, max(0.0, u))
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))
