"""One tracker pose as OpenVR reports it in, one object pose in the rig frame out.

Pure. A pose that cannot be right (not valid, disconnected, not finite, not a rotation, beyond
100 m) gives an ObjectPose with tracking "lost" and neutral numbers: the last good pose is not held,
nothing is extrapolated. A device that rig.toml does not name gives None and is counted. Without
calibration/objects.json poses stay in the lighthouse frame with registered = false. Late poses are
not reordered: each keeps its own stamp.
"""

from __future__ import annotations

import numpy as np

from rhot.files.calibration import Objects
from rhot.files.config import RigConfig
from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    transform,
)
from rhot.messages import Quat, Vec3
from rhot.messages.objects import ObjectPose, ObjectTracking, OpenVrPose
from services.object_tracker.registration import Placement, Registration, is_rotation, register

# ETrackingResult of openvr.h; every other value (1 is Uninitialized) is "lost".
_TRACKING: dict[int, ObjectTracking] = {
    100: "calibrating",  # Calibrating_InProgress
    101: "calibrating",  # Calibrating_OutOfRange
    200: "ok",  # Running_OK
    201: "out_of_range",  # Running_OutOfRange
    300: "rotation_only",  # Fallback_RotationOnly
}
# 20 minutes of SteamVR poses (vive/marvin) stay within 2e-7 of a rotation (float32); 1e-3 still
# excludes any real scale or shear.
_ROTATION_TOLERANCE = 1e-3
# Lighthouses reach 10 m; SteamVR was seen to jump some metres when it locates them again. What is
# beyond 100 m is no pose.
_MAX_DISTANCE_M = 100.0
# A thrown tracker stays under 30 m/s and a spun one under 60 rad/s; ten times that is no velocity.
_MAX_SPEED = 600.0
# Serials kept so that people can see what to write into rig.toml; OpenVR has 64 slots.
_MAX_UNKNOWN = 64
_LATEST_STAMP_NS = 2**63 - 1


class ObjectStep:
    """Turns trackers' poses into objects' poses.

    unknown counts poses of devices that rig.toml does not name, unknown_serials holds the first 64
    of them; lost counts poses with tracking "lost". Raises CalibrationError at construction if
    objects.json cannot be right.
    """

    def __init__(self, config: RigConfig, objects: Objects | None) -> None:
        self._registration: Registration = register(config, objects)
        self.unknown = 0
        self.unknown_serials: set[str] = set()
        self.lost = 0

    @property
    def registered(self) -> bool:
        """Whether poses come out in the rig frame."""
        return self._registration.registered

    def step(self, pose: OpenVrPose) -> ObjectPose | None:
        """The object's pose at the same instant, less the tracker's own delay.

        None for a device that rig.toml does not name. T_rig_from_object = T_rig_from_lighthouse @
        T_lighthouse_from_tracker @ T_tracker_from_object. The velocity is that of the object's
        origin, v + w x r with r from the tracker to it (rigid body); v and w are in the rig frame.
        """
        placement = self._registration.placements.get(pose.device.serial)
        if placement is None:
            self.unknown += 1
            if len(self.unknown_serials) < _MAX_UNKNOWN:
                self.unknown_serials.add(pose.device.serial)
            return None
        tracking = _TRACKING.get(pose.eTrackingResult)
        T_lighthouse_from_tracker = _valid_transform(pose)
        if tracking is None or T_lighthouse_from_tracker is None:
            self.lost += 1
            return self._message(pose, placement, "lost", np.eye(4), np.zeros(3), np.zeros(3))
        T_rig_from_lighthouse = self._registration.T_rig_from_lighthouse
        R_rig_from_lighthouse = T_rig_from_lighthouse[:3, :3]
        lever_lighthouse = (
            T_lighthouse_from_tracker[:3, :3] @ placement.T_tracker_from_object[:3, 3]
        )  # (3,)
        w_lighthouse = np.array(pose.vAngularVelocity)
        v_lighthouse = np.array(pose.vVelocity) + np.cross(w_lighthouse, lever_lighthouse)
        T_rig_from_object = (
            T_rig_from_lighthouse @ T_lighthouse_from_tracker @ placement.T_tracker_from_object
        )
        return self._message(
            pose,
            placement,
            tracking,
            T_rig_from_object,
            R_rig_from_lighthouse @ v_lighthouse,
            R_rig_from_lighthouse @ w_lighthouse,
        )

    def _message(
        self,
        pose: OpenVrPose,
        placement: Placement,
        tracking: ObjectTracking,
        T: Array,
        velocity_m_s: Array,
        angular_velocity_rad_s: Array,
    ) -> ObjectPose:
        return ObjectPose(
            object=placement.name,
            serial=pose.device.serial,
            seq=pose.seq,
            stamp_ns=min(max(pose.stamp_ns - placement.time_offset_ns, 0), _LATEST_STAMP_NS),
            position_m=_vec3(T[:3, 3]),
            orientation_wxyz=_quat(quaternion_from_rotation(T[:3, :3])),
            velocity_m_s=_vec3(velocity_m_s),
            angular_velocity_rad_s=_vec3(angular_velocity_rad_s),
            tracking=tracking,
            registered=self._registration.registered,
        )


def _valid_transform(pose: OpenVrPose) -> Array | None:
    """T_lighthouse_from_tracker (4, 4), made exactly rigid; None if the pose cannot be right."""
    if not pose.bPoseIsValid or not pose.bDeviceIsConnected:
        return None
    rows = np.array(pose.mDeviceToAbsoluteTracking, dtype=np.float64)  # (3, 4)
    speeds = np.array([pose.vVelocity, pose.vAngularVelocity], dtype=np.float64)
    # Comparisons written so that NaN fails them.
    if not np.all(np.abs(rows[:, 3]) <= _MAX_DISTANCE_M) or not np.all(
        np.abs(speeds) <= _MAX_SPEED
    ):
        return None
    if not is_rotation(rows[:, :3], _ROTATION_TOLERANCE):
        return None
    return transform(rotation_from_quaternion(quaternion_from_rotation(rows[:, :3])), rows[:, 3])


def _vec3(values: Array) -> Vec3:
    """Rounded to the micrometre (or um/s, urad/s): a thousandth of what lighthouses resolve."""
    x, y, z = (round(v, 6) + 0.0 for v in values.tolist())
    return (x, y, z)


def _quat(values: Array) -> Quat:
    w, x, y, z = (round(v, 6) + 0.0 for v in values.tolist())
    return (w, x, y, z)
