"""The simulated Vive trackers, with the fields of OpenVR. Pure.

Poses are in the lighthouse frame with the jitter of a real tracker, and with the faults that
[simulator] of rig.toml asks for; the same (scene, object, seq) gives the same pose.
"""

from __future__ import annotations

import zlib
from typing import NamedTuple

import numpy as np

from rhot.files.simulator_table import Simulator
from rhot.geometry.transforms import (
    Array,
    inverse,
    rotation_from_vector,
    rotation_y,
    transform,
    vector_from_rotation,
)
from rhot.messages.objects import OpenVrDevice, OpenVrPose
from services.simulator.scene.actors import SceneObject
from services.simulator.scene.scene import Scene
from services.simulator.scene.truth import rounded_vector

# Half the base of the central difference for velocities.
_STEP_S = 1e-3
# ETrackingResult: TrackingResult_Running_OK, _Running_OutOfRange.
_RUNNING_OK, _OUT_OF_RANGE = 200, 201
# How far an outlier is off: real recordings have some of up to 224 mm.
_OUTLIER_M, _OUTLIER_RAD = (0.02, 0.2), np.deg2rad(20.0)
# A tracker that loses sight does so for about this long.
_DROPOUT_S = 0.4


class _Motion(NamedTuple):
    """Of a tracker at one instant, in the lighthouse frame."""

    T: Array  # (4, 4)
    velocity: Array  # (3,) m/s
    angular_velocity: Array  # (3,) rad/s


def tracker_pose(
    scene: Scene, item: SceneObject, index: int, t_s: float, seq: int, stamp_ns: int
) -> OpenVrPose:
    """What SteamVR would report of an object's tracker at t_s, sensor noise included.

    stamp_ns is the instant on the master's clock; the message carries it late by the object's
    time_offset_ns and by what [simulator] says. A tracker out of sight keeps its last pose, which
    is not valid.
    """
    settings = scene.config.simulator
    lost = _lost(scene, item, t_s)
    rng = np.random.default_rng([scene.seed, zlib.crc32(item.serial.encode()), seq])
    if lost:
        motion = _Motion(_tracker_frame(scene, item, t_s // _DROPOUT_S * _DROPOUT_S), *_STANDING)
    else:
        motion = _motion(scene, item, t_s)
    rotation, position = _noisy(motion.T, settings, rng)
    rows = np.round(np.column_stack([rotation, position]), 7).tolist()
    late_ns = item.place.time_offset_ns + round(settings.tracker_late_ms * 1e6)
    return OpenVrPose(
        v=1,
        seq=seq,
        stamp_ns=max(0, stamp_ns + late_ns),
        universe="simulated",
        device=OpenVrDevice(
            index=index,
            serial=item.serial,
            device_class="GenericTracker",
            model="VIVE Tracker Pro MV",
            battery=0.9,
            charging=False,
        ),
        mDeviceToAbsoluteTracking=(tuple(rows[0]), tuple(rows[1]), tuple(rows[2])),
        vVelocity=rounded_vector(motion.velocity + rng.normal(0.0, 0.005, 3)),
        vAngularVelocity=rounded_vector(motion.angular_velocity + rng.normal(0.0, 0.01, 3)),
        eTrackingResult=_OUT_OF_RANGE if lost else _RUNNING_OK,
        bPoseIsValid=not lost,
        bDeviceIsConnected=True,
    )


_STANDING = (np.zeros(3), np.zeros(3))


def _motion(scene: Scene, item: SceneObject, t_s: float) -> _Motion:
    T_before = _tracker_frame(scene, item, t_s - _STEP_S)
    T = _tracker_frame(scene, item, t_s)
    T_after = _tracker_frame(scene, item, t_s + _STEP_S)
    velocity = (T_after[:3, 3] - T_before[:3, 3]) / (2.0 * _STEP_S)
    turn = vector_from_rotation(T_after[:3, :3] @ T_before[:3, :3].T)
    return _Motion(T, velocity, turn / (2.0 * _STEP_S))


def _noisy(T: Array, settings: Simulator, rng: np.random.Generator) -> tuple[Array, Array]:
    """Rotation and position with jitter, and now and then an outlier."""
    turn_sigma = np.deg2rad(settings.tracker_noise_deg) / np.sqrt(3.0)
    rotation = rotation_from_vector(rng.normal(0.0, turn_sigma, 3)) @ T[:3, :3]
    position = T[:3, 3] + rng.normal(0.0, settings.tracker_noise_m / np.sqrt(3.0), 3)
    if settings.tracker_outliers and rng.random() < settings.tracker_outliers:
        way = rng.normal(0.0, 1.0, 3)
        position = position + rng.uniform(*_OUTLIER_M) * way / np.linalg.norm(way)
        rotation = rotation_from_vector(rng.uniform(-_OUTLIER_RAD, _OUTLIER_RAD, 3)) @ rotation
    return rotation, position


def _lost(scene: Scene, item: SceneObject, t_s: float) -> bool:
    share = scene.config.simulator.tracker_dropouts
    if not share:
        return False
    block = max(0, int(t_s // _DROPOUT_S))
    seeds = [scene.seed, zlib.crc32(item.serial.encode()), block, 41]
    return bool(np.random.default_rng(seeds).random() < share)


def lighthouse_pose(scene: Scene, t_s: float) -> Array:
    """T_rig_from_lighthouse (4, 4): where the base stations are, once somebody has moved them."""
    settings = scene.config.simulator
    if t_s < settings.lighthouse_moves_s:
        return scene.T_rig_from_lighthouse
    turn = rotation_y(float(np.deg2rad(settings.lighthouse_turn_deg)))
    moved = transform(turn, (settings.lighthouse_shift_m, 0.0, 0.0))
    return np.asarray(scene.T_rig_from_lighthouse @ moved)


def _tracker_frame(scene: Scene, item: SceneObject, t_s: float) -> Array:
    """T_lighthouse_from_tracker (4, 4)."""
    # What nobody holds does not depend on the hands, whose state takes longer to compute.
    T_rig_from_object = item.pose_at(t_s, scene.hand_states(t_s) if item.holder else {})
    return inverse(lighthouse_pose(scene, t_s)) @ T_rig_from_object @ item.T_object_from_tracker
