"""One tracked device: its messages in order, read, tracked, smoothed; and what is wrong with it.

Pure. `take` gives where the device is now, in the lighthouse frame, or None where a message is left
out: it is counted, with the reason.
"""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from rhot.messages import Vec3
from rhot.messages.objects import OpenVrPose
from services.object_tracker.filter.smoothing import Smoother
from services.object_tracker.filter.track import Track, TrackKeeper
from services.object_tracker.intake.order import MessageOrder
from services.object_tracker.intake.reading import LOST, Reading, read

# A text says how things stand; what was wrong for the last time so long ago is over.
_OVER_NS = 5_000_000_000
# SteamVR warns at 15 %; with two more it is over, so that it does not come and go.
_BATTERY_LOW, _BATTERY_GOOD = 0.15, 0.17
# Poses that disagree are withheld; for longer than this the device is lost. It is as long as poses
# are carried on (rhot/object_motion.py).
_DOUBT_NS = 100_000_000
# Poses until a track's own velocity is one.
_SETTLED = 3
_LATEST_STAMP_NS = 2**63 - 1


class Where(NamedTuple):
    """A device's pose at stamp_ns of the master's clock, in the lighthouse frame."""

    stamp_ns: int
    reading: Reading
    sigma_m: float | None
    sigma_rad: float | None


class Device:
    """What is known of one device. Arrivals are in ns of one clock, None where files are read."""

    def __init__(self, leash_m: float) -> None:
        self.left_out: Counter[str] = Counter()
        self.stamp_ns = 0
        self.arrived_ns: int | None = None
        self._clock_known = False
        self._order = MessageOrder()
        self._keeper = TrackKeeper()
        self._smoother = Smoother(leash_m) if leash_m > 0.0 else None
        self._sure_ns = 0
        self._misread_ns: int | None = None
        self._misread: Counter[str] = Counter()
        self._battery = 1.0
        self._battery_low = False

    def take(self, pose: OpenVrPose, arrival_ns: int | None) -> Where | None:
        """Where the device is with this message, or None: left_out counts why."""
        stamp_ns = min(max(pose.stamp_ns - pose.clock_offset_ns, 0), _LATEST_STAMP_NS)
        now_ns = stamp_ns if arrival_ns is None else arrival_ns
        if pose.clock_sigma_ns >= 0 and not self._clock_known:
            # The sender has found its clock's offset: what it sent before was on another clock.
            self._clock_known = True
            self._order = MessageOrder()
            self._keeper.forget()
        reading = read(pose)
        if isinstance(reading, str):
            self.left_out[reading] += 1
            self._misread[reading] += 1
            self._misread_ns = now_ns
            return None
        verdict = self._order.judge(pose.seq, stamp_ns, arrival_ns)
        if verdict != "next":
            self.left_out[verdict] += 1
            return None
        if stamp_ns < self.stamp_ns:
            self._keeper.forget()
        self.stamp_ns, self.arrived_ns = stamp_ns, arrival_ns
        self._watch_battery(pose)
        return self._track(stamp_ns, reading)

    def _track(self, stamp_ns: int, reading: Reading) -> Where | None:
        tracking = reading.tracking
        if tracking != "ok":
            # The device says itself that it does not know: what comes next is a new beginning.
            self._keeper.forget()
            self._sure_ns = stamp_ns
            return Where(stamp_ns, reading, None, None)
        track = self._keeper.take(stamp_ns, reading.position_m, reading.orientation_wxyz)
        if track is None:
            self.left_out["outlier"] += 1
            doubted_ns = stamp_ns - self._sure_ns
            return Where(stamp_ns, LOST, None, None) if doubted_ns > _DOUBT_NS else None
        self._sure_ns = stamp_ns
        position_m, orientation = reading.position_m, reading.orientation_wxyz
        if self._smoother is not None:
            position_m, orientation = self._smoother.take(stamp_ns, position_m, orientation)
        told = Reading(tracking, position_m, orientation, *_velocities(reading, track))
        return Where(stamp_ns, told, track.sigma_m, track.sigma_rad)

    def _watch_battery(self, pose: OpenVrPose) -> None:
        battery = pose.device.battery
        # 0 and -1 stand for a battery nobody has asked for.
        if not 0.0 < battery <= 1.0:
            return
        limit = _BATTERY_GOOD if self._battery_low else _BATTERY_LOW
        self._battery, self._battery_low = battery, battery < limit and not pose.device.charging

    def faults(self, serial: str, now_ns: int) -> dict[str, str]:
        """What is wrong with the device now, by the fault's code; now_ns is an arrival's clock."""
        texts = {}
        if self._misread_ns is not None and 0 <= now_ns - self._misread_ns < _OVER_NS:
            counts = ", ".join(f"{n} for their {why}" for why, n in sorted(self._misread.items()))
            texts["device_misread"] = f"poses of {serial} are left out: {counts}"
        if self._order.twice(now_ns):
            texts["device_twice"] = (
                f"two senders publish poses of {serial}: those of the second one,"
                f" {self.left_out['second_sender']} so far, are left out"
            )
        if self._battery_low:
            texts["device_battery"] = f"the battery of {serial} is at {100 * self._battery:.0f} %"
        return texts


def _velocities(reading: Reading, track: Track) -> tuple[Vec3, Vec3]:
    """The device's own velocities, or the track's where it tells none."""
    told = any(reading.velocity_m_s) or any(reading.angular_velocity_rad_s)
    if told or track.count < _SETTLED:
        return reading.velocity_m_s, reading.angular_velocity_rad_s
    return track.velocity_m_s, track.angular_velocity_rad_s
