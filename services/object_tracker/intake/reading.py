"""One OpenVrPose, read strictly: a device's pose that can be right, or the reason why it cannot.

Pure. What the device itself says of its pose (not valid, disconnected, calibrating, out of range)
is a state; what cannot come from a working device (no rotation, not finite, beyond 100 m, faster
than anything thrown, a result code or a version nobody knows) is misread.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from rhot.geometry.quaternions import Quat, from_rows
from rhot.messages import Vec3
from rhot.messages.objects import ObjectTracking, OpenVrPose

Misread = Literal["version", "result", "position", "rotation", "velocity"]

# ETrackingResult of openvr.h, all of them: IVRSystem's documentation gives no others.
TRACKING_RESULTS: dict[int, ObjectTracking] = {
    1: "lost",  # Uninitialized
    100: "calibrating",  # Calibrating_InProgress
    101: "calibrating",  # Calibrating_OutOfRange
    200: "ok",  # Running_OK
    201: "out_of_range",  # Running_OutOfRange
    300: "rotation_only",  # Fallback_RotationOnly
}
# OpenVrPose.v as this release writes it; another one may mean something else by the same names.
_VERSION = 1
# 20 minutes of SteamVR poses (vive/marvin) stay within 2e-7 of a rotation (float32); 1e-3 still
# excludes any real scale or shear.
_ROTATION_TOLERANCE = 1e-3
# Lighthouses reach 10 m; SteamVR was seen to jump some metres when it locates them again. What is
# beyond 100 m is no pose.
_MAX_DISTANCE_M = 100.0
# A thrown tracker stays under 30 m/s and a spun one under 60 rad/s; ten times that is no velocity.
_MAX_SPEED = 600.0


class Reading(NamedTuple):
    """A device's pose in the lighthouse frame, without its stamp. All zero where it is lost."""

    tracking: ObjectTracking
    position_m: Vec3
    orientation_wxyz: Quat
    velocity_m_s: Vec3
    angular_velocity_rad_s: Vec3


_ZERO: Vec3 = (0.0, 0.0, 0.0)
LOST = Reading("lost", _ZERO, (1.0, 0.0, 0.0, 0.0), _ZERO, _ZERO)


def read(pose: OpenVrPose) -> Reading | Misread:
    """The pose, made exactly rigid, or why it is left out. The numbers of a lost one are not
    looked at: SteamVR fills them with anything.
    """
    if pose.v != _VERSION:
        return "version"
    tracking = TRACKING_RESULTS.get(pose.eTrackingResult)
    if tracking is None:
        return "result"
    if not pose.bPoseIsValid or not pose.bDeviceIsConnected or tracking == "lost":
        return LOST
    rows = pose.mDeviceToAbsoluteTracking
    (a, b, c, x), (d, e, f, y), (g, h, i, z) = rows
    # Comparisons are written so that NaN fails them.
    limit = _MAX_DISTANCE_M
    if not (-limit <= x <= limit and -limit <= y <= limit and -limit <= z <= limit):
        return "position"
    for speeds in (pose.vVelocity, pose.vAngularVelocity):
        for speed in speeds:
            if not -_MAX_SPEED <= speed <= _MAX_SPEED:
                return "velocity"
    if not _is_rotation(a, b, c, d, e, f, g, h, i):
        return "rotation"
    return Reading(tracking, (x, y, z), from_rows(rows), pose.vVelocity, pose.vAngularVelocity)


def _is_rotation(
    a: float, b: float, c: float, d: float, e: float, f: float, g: float, h: float, i: float
) -> bool:
    """Whether the rows abc, def, ghi are orthonormal within the tolerance, and right-handed."""
    slack = _ROTATION_TOLERANCE
    if not (
        -slack <= a * a + b * b + c * c - 1.0 <= slack
        and -slack <= d * d + e * e + f * f - 1.0 <= slack
        and -slack <= g * g + h * h + i * i - 1.0 <= slack
        and -slack <= a * d + b * e + c * f <= slack
        and -slack <= a * g + b * h + c * i <= slack
        and -slack <= d * g + e * h + f * i <= slack
    ):
        return False
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0.0
