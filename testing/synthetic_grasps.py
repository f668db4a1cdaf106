"""Hands that take cups, or pass beside them, as solver and object tracker make them of points with
noise, beside the truth of testing/grasp_scene.py.

The landmarks' errors are as rendered hands show them: less across the view than in depth, part of
it common to all, part lasting, part white; the hand is then solved by the solver itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, quaternion_from_rotation, rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, HandModel, forward, landmark_point
from rhot.hand_skin import PARTS
from rhot.messages import FingerAngles, HandPoint, HandPoints, HandPose, WristPose
from rhot.messages.objects import ObjectPose
from rhot.messages.simulator import HandTruth, ObjectTruth, Truth
from services.solver.step import SolverStep
from testing.grasp_scene import GraspScene as GraspScene
from testing.grasp_scene import Instant
from testing.grasp_scene import Setting as Setting

START_NS = 10**18
# Of the landmarks, one standard deviation across the view and along it. Rendered hands at half a
# metre ("grab" and "fist" of the simulator) leave 0.4 and 1.2 mm at the tips.
_ACROSS_M, _DEPTH_M = 0.0005, 0.0013
# Shares of the variance: common to the whole hand, and how it lasts (for good, 0.15 s, white).
_COMMON, _LASTING, _SLOW = 0.35, 0.3, 0.4
_SLOW_S = 0.15
# Of an object tracker's pose behind its filter: across 1 mm and 0.3 deg in all.
_OBJECT_M, _OBJECT_RAD = 1e-3 / np.sqrt(3.0), np.deg2rad(0.3) / np.sqrt(3.0)


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
