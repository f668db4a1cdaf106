"""Where an object is at another instant than that of its message. Pure.

Between two messages a pose is interpolated; after the last one it is carried on with its own
velocities, up to HORIZON_NS. ObjectHistory keeps the last ones of an object for that.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right

from rhot.geometry.quaternions import from_vector, multiply, normalized, slerp
from rhot.messages import Vec3
from rhot.messages.objects import ObjectPose, ObjectTracking

# Real hands turn sharply, 8..20 m/s^2 within a frame: after 0.1 s at 20 m/s^2 a prediction is 10 cm
# off, and no longer one.
HORIZON_NS = 100_000_000
_HAND_ACCELERATION_M_S2 = 20.0
# A wrist turns its hand at up to 20 rad/s within some 0.1 s.
_HAND_ACCELERATION_RAD_S2 = 200.0
# 0.5 s: a hand's pose comes at most some frames after its pictures. 512 poses are 0.5 s at 1 kHz,
# the fastest source that rig.toml allows.
_KEPT_NS = 500_000_000
_MAX_POSES = 512
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


class ObjectHistory:
    """Half a second of ObjectPose of one object, by their stamps."""

    def __init__(self, horizon_ns: int = HORIZON_NS) -> None:
        """horizon_ns: how far a pose is carried on, and the longest gap that is bridged."""
        self._horizon_ns = horizon_ns
        self._poses: list[ObjectPose] = []
        self._stamps: list[int] = []

    def add(self, pose: ObjectPose) -> None:
        """The next pose. One that is older than the last begins a new history: time was set."""
        if self._stamps and pose.stamp_ns < self._stamps[-1]:
            self._poses.clear()
            self._stamps.clear()
        self._poses.append(pose)
        self._stamps.append(pose.stamp_ns)
        # Emptied by halves: a list that loses its first element at every pose moves all the others.
        if len(self._stamps) >= 2 * _MAX_POSES or (
            len(self._stamps) % 64 == 0 and pose.stamp_ns - self._stamps[0] > 2 * _KEPT_NS
        ):
            old = bisect_left(self._stamps, pose.stamp_ns - _KEPT_NS)
            old = max(old, len(self._stamps) - _MAX_POSES)
            del self._poses[:old], self._stamps[:old]

    @property
    def newest(self) -> ObjectPose | None:
        """The last pose added."""
        return self._poses[-1] if self._poses else None

    def at(self, stamp_ns: int) -> ObjectPose | None:
        """The object at that instant: interpolated inside, predicted after the newest pose.

        None before the oldest pose, further than the horizon from the next earlier pose, and
        wherever the object is lost; its `tracking` and `registered` are to be looked at as those of
        a message are.
        """
        after = bisect_right(self._stamps, stamp_ns)
        if after == 0:
            return None
        before = self._poses[after - 1]
        if before.tracking == "lost" or stamp_ns - before.stamp_ns > self._horizon_ns:
            return None
        if before.stamp_ns == stamp_ns:
            return before
        if after < len(self._poses):
            following = self._poses[after]
            if (
                following.tracking != "lost"
                and following.registered == before.registered
                and following.stamp_ns - before.stamp_ns <= self._horizon_ns
            ):
                return between(before, following, stamp_ns)
        return predict(before, stamp_ns, self._horizon_ns)
