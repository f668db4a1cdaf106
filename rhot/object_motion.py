"""Where an object is at another instant than that of its message. Pure.

Between two messages a pose is interpolated; after the last one it is carried on with its own
velocities, up to HORIZON_NS.
"""

from __future__ import annotations

from rhot.geometry.quaternions import from_vector, multiply, normalized, slerp
from rhot.messages import Vec3
from rhot.messages.objects import ObjectPose, ObjectTracking

# Real hands turn sharply, 8..20 m/s^2 within a frame: after 0.1 s at 20 m/s^2 a prediction is 10 cm
# off, and no longer one.
HORIZON_NS = 100_000_000
_HAND_ACCELERATION_M_S2 = 20.0
# A wrist turns its hand at up to 20 rad/s within some 0.1 s.
_HAND_ACCELERATION_RAD_S2 = 200.0
# From bad to good: between two messages the worse one's state holds.
_ORDER: tuple[ObjectTracking, ...] = (
    "lost",
    "unregistered",
    "calibrating",
    "rotation_only",
    "out_of_range",
    "ok",
)


def predict(pose: ObjectPose, at_ns: int, horizon_ns: int = HORIZON_NS) -> ObjectPose:
    """The object at at_ns, before or after the message, if it keeps its velocities.

    Further than horizon_ns away the pose is the one at the horizon, and its tracking is "lost"; a
    lost one stays as it is. sigma_m and sigma_rad, where known, grow with what a hand can do
    meanwhile.
    """
    wanted_ns = at_ns - pose.stamp_ns
    ahead_s = min(max(wanted_ns, -horizon_ns), horizon_ns) * 1e-9
    if pose.tracking == "lost":
        ahead_s = 0.0
    px, py, pz = pose.position_m
    vx, vy, vz = pose.velocity_m_s
    wx, wy, wz = pose.angular_velocity_rad_s
    turn = from_vector(wx * ahead_s, wy * ahead_s, wz * ahead_s)
    return ObjectPose(
        object=pose.object,
        serial=pose.serial,
        seq=pose.seq,
        stamp_ns=at_ns,
        position_m=(px + vx * ahead_s, py + vy * ahead_s, pz + vz * ahead_s),
        orientation_wxyz=normalized(multiply(turn, pose.orientation_wxyz)),
        velocity_m_s=pose.velocity_m_s,
        angular_velocity_rad_s=pose.angular_velocity_rad_s,
        tracking=pose.tracking if abs(wanted_ns) <= horizon_ns else "lost",
        registered=pose.registered,
        sigma_m=_grown(pose.sigma_m, _HAND_ACCELERATION_M_S2, ahead_s),
        sigma_rad=_grown(pose.sigma_rad, _HAND_ACCELERATION_RAD_S2, ahead_s),
        sent_ns=pose.sent_ns,
    )


def between(before: ObjectPose, after: ObjectPose, at_ns: int) -> ObjectPose:
    """The object at an instant between two messages of it: straight line, shortest turn.

    tracking is the worse one's, registered where both are. Where before and after are of one
    instant it is `after`.
    """
    gap_ns = after.stamp_ns - before.stamp_ns
    share = (at_ns - before.stamp_ns) / gap_ns if gap_ns > 0 else 1.0
    tracking = min(before.tracking, after.tracking, key=_ORDER.index)
    return ObjectPose(
        object=after.object,
        serial=after.serial,
        seq=after.seq,
        stamp_ns=at_ns,
        position_m=_mixed(before.position_m, after.position_m, share),
        orientation_wxyz=slerp(before.orientation_wxyz, after.orientation_wxyz, share),
        velocity_m_s=_mixed(before.velocity_m_s, after.velocity_m_s, share),
        angular_velocity_rad_s=_mixed(
            before.angular_velocity_rad_s, after.angular_velocity_rad_s, share
        ),
        tracking=tracking,
        registered=before.registered and after.registered,
        sigma_m=_larger(before.sigma_m, after.sigma_m),
        sigma_rad=_larger(before.sigma_rad, after.sigma_rad),
        sent_ns=after.sent_ns,
    )


def _mixed(a: Vec3, b: Vec3, share: float) -> Vec3:
    return (
        a[0] + (b[0] - a[0]) * share,
        a[1] + (b[1] - a[1]) * share,
        a[2] + (b[2] - a[2]) * share,
    )


def _grown(sigma: float | None, acceleration: float, ahead_s: float) -> float | None:
    # The acceleration is a peak; its RMS is about half of it: x = a t^2 / 2, halved again.
    return None if sigma is None else sigma + 0.25 * acceleration * ahead_s * ahead_s


def _larger(a: float | None, b: float | None) -> float | None:
    return None if a is None or b is None else max(a, b)
