"""The simulated Vive trackers, with the fields of OpenVR. Pure.

Poses are in the lighthouse frame with the jitter of a real tracker; the same (scene, object, seq)
gives the same pose.
"""

from __future__ import annotations

import zlib

import numpy as np

from rhot.geometry.transforms import Array, inverse, rotation_from_vector, vector_from_rotation
from rhot.messages.objects import OpenVrDevice, OpenVrPose
from services.simulator.scene.actors import SceneObject
from services.simulator.scene.scene import Scene
from services.simulator.scene.truth import rounded_vector

# Jitter of a Vive tracker in daily use; the laser-tracker study in the real recordings leaves 5.65
# mm RMS over a room.
_POSITION_SIGMA_M, _TURN_SIGMA_RAD = 1e-3, np.deg2rad(0.3)
# Half the base of the central difference for velocities.
_STEP_S = 1e-3
# ETrackingResult: TrackingResult_Running_OK.
_RUNNING_OK = 200


def tracker_pose(
    scene: Scene, item: SceneObject, index: int, t_s: float, seq: int, stamp_ns: int
) -> OpenVrPose:
    """What SteamVR would report of an object's tracker at t_s, sensor noise included.

    stamp_ns is the instant on the master's clock; the message carries it late by the object's
    time_offset_ns.
    """
    rng = np.random.default_rng([scene.seed, zlib.crc32(item.serial.encode()), seq])
    T_before = _tracker_frame(scene, item, t_s - _STEP_S)
    T = _tracker_frame(scene, item, t_s)
    T_after = _tracker_frame(scene, item, t_s + _STEP_S)
    velocity = (T_after[:3, 3] - T_before[:3, 3]) / (2.0 * _STEP_S)
    angular_velocity = vector_from_rotation(T_after[:3, :3] @ T_before[:3, :3].T) / (2.0 * _STEP_S)
    rotation = rotation_from_vector(rng.normal(0.0, _TURN_SIGMA_RAD / np.sqrt(3.0), 3)) @ T[:3, :3]
    position = T[:3, 3] + rng.normal(0.0, _POSITION_SIGMA_M / np.sqrt(3.0), 3)
    rows = np.round(np.column_stack([rotation, position]), 7).tolist()
    return OpenVrPose(
        v=1,
        seq=seq,
        stamp_ns=max(0, stamp_ns + item.place.time_offset_ns),
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
        vVelocity=rounded_vector(velocity + rng.normal(0.0, 0.005, 3)),
        vAngularVelocity=rounded_vector(angular_velocity + rng.normal(0.0, 0.01, 3)),
        eTrackingResult=_RUNNING_OK,
        bPoseIsValid=True,
        bDeviceIsConnected=True,
    )


def _tracker_frame(scene: Scene, item: SceneObject, t_s: float) -> Array:
    """T_lighthouse_from_tracker (4, 4)."""
    # What nobody holds does not depend on the hands, whose state takes longer to compute.
    T_rig_from_object = item.pose_given(scene.hand_states(t_s) if item.holder else {})
    return inverse(scene.T_rig_from_lighthouse) @ T_rig_from_object @ item.T_object_from_tracker
