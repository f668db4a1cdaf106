"""One tracker pose as OpenVR reports it in, one object pose in the rig frame out.

Pure. What a device says of itself (not valid, disconnected, uninitialised) gives an ObjectPose with
tracking "lost" and neutral numbers: the last good pose is not held, nothing is extrapolated. What
cannot be right (misread, of another time, of a second sender, an outlier) gives None and is
counted. A device that rig.toml does not name gives None and is counted. Without
calibration/objects.json, or where it no longer holds, poses stay in the lighthouse frame with
registered = false, and what would be "ok" is "unregistered". A device that falls silent is told as
"lost" by `silent`.
"""

from __future__ import annotations

import math
from collections import Counter

from rhot.files.calibration import Objects
from rhot.files.config import RigConfig
from rhot.geometry.quaternions import Quat, multiply, normalized, rotate
from rhot.geometry.transforms import Array
from rhot.messages import Vec3
from rhot.messages.objects import ObjectPose, OpenVrEvent, OpenVrPose
from services.object_tracker.device import Device, Where
from services.object_tracker.intake.frames import FrameWatch
from services.object_tracker.intake.reading import LOST
from services.object_tracker.registration import Placement, Registration, corrected, register

# Serials kept so that people can see what to write into rig.toml; OpenVR has 64 slots.
_MAX_UNKNOWN = 64
# The slowest source sends 90 poses a second; after half a second it has stopped.
_SILENT_NS = 500_000_000
_LATEST_STAMP_NS = 2**63 - 1
# A wire's digits: a micrometre.
_UNITS = 1e6


class ObjectStep:
    """Turns trackers' poses into objects' poses.

    unknown counts poses of devices that rig.toml does not name, unknown_serials holds the first 64
    of them; lost counts poses with tracking "lost". Raises CalibrationError at construction if
    objects.json cannot be right.
    """

    def __init__(self, config: RigConfig, objects: Objects | None) -> None:
        self._registration: Registration = register(config, objects)
        self._uncorrected = self._registration
        self._frames = FrameWatch(objects.universe if objects else "")
        leash_m = config.objects.filter_mm * 1e-3
        self._devices = {serial: Device(leash_m) for serial in self._registration.placements}
        self.unknown = 0
        self.unknown_serials: set[str] = set()
        self.lost = 0

    @property
    def registered(self) -> bool:
        """Whether objects.json is there; `faults` tells where it no longer holds."""
        return self._registration.registered

    def knows(self, serial: str) -> bool:
        """Whether rig.toml names that device."""
        return serial in self._devices

    def step(self, pose: OpenVrPose, arrival_ns: int | None = None) -> ObjectPose | None:
        """The object's pose at the instant of the tracker's, on the master's clock.

        arrival_ns is CLOCK_REALTIME as the message came, None where a file is read. None for a
        message that is left out. T_rig_from_object = T_rig_from_lighthouse @
        T_lighthouse_from_tracker @ T_tracker_from_object. The velocity is that of the object's
        origin, v + w x r with r from the tracker to it (rigid body); v and w are in the rig frame.
        """
        serial = pose.device.serial
        device = self._devices.get(serial)
        if device is None:
            self.unknown += 1
            if len(self.unknown_serials) < _MAX_UNKNOWN:
                self.unknown_serials.add(serial)
            return None
        where = device.take(pose, arrival_ns)
        if where is None:
            return None
        holds = self._frames.holds(serial, pose.universe) and self._registration.registered
        return self._message(serial, pose.seq, where, holds=holds)

    def correct(self, T_rig_from_before: Array) -> None:
        """Put a small rigid motion (4, 4) before objects.json's registration, from now on."""
        self._registration = corrected(self._uncorrected, T_rig_from_before)

    def event(self, event: OpenVrEvent) -> str | None:
        """Takes in what SteamVR says of its frame; a warning to tell, or None."""
        return self._frames.event(event)

    def silent(self, now_ns: int) -> list[ObjectPose]:
        """A "lost" for each object whose tracker has sent before, and has stopped.

        now_ns is on the clock of the arrivals. Stamps go on from the last one's.
        """
        lost = []
        for serial, device in self._devices.items():
            if device.arrived_ns is None or now_ns - device.arrived_ns < _SILENT_NS:
                continue
            where = Where(device.stamp_ns + now_ns - device.arrived_ns, LOST, None, None)
            lost.append(self._message(serial, 0, where, holds=self._registration.registered))
        return lost

    def faults(self, now_ns: int) -> dict[str, dict[str, str]]:
        """What is wrong with devices and with the registration: texts by code and by subject."""
        stale = self._frames.texts() if self._registration.registered else {}
        found: dict[str, dict[str, str]] = {
            "registration_stale": {
                subject: f"{text}: objects stay in the lighthouse frame"
                for subject, text in stale.items()
            },
            "device_misread": {},
            "device_twice": {},
            "device_battery": {},
        }
        for serial, device in self._devices.items():
            for code, text in device.faults(serial, now_ns).items():
                found[code][serial] = text
        return found

    def values(self) -> dict[str, float]:
        """Counts for health: what was left out, by its reason."""
        reasons: Counter[str] = Counter()
        for device in self._devices.values():
            reasons.update(device.left_out)
        holds = self.registered and not self._frames.texts()
        counts = {f"left_out_{reason}": float(n) for reason, n in reasons.items()}
        return {"registered": float(holds), "lost": self.lost, "unknown": self.unknown} | counts

    def _message(self, serial: str, seq: int, where: Where, *, holds: bool) -> ObjectPose:
        placement = self._registration.placements[serial]
        tracking, position_m, orientation, velocity, spin = where.reading
        sigma_m = sigma_rad = None
        if tracking == "lost":
            self.lost += 1
        else:
            lever = rotate(orientation, placement.offset_m)
            position_m = _sum(position_m, lever)
            velocity = _sum(velocity, _cross(spin, lever))
            orientation = multiply(orientation, placement.orientation_wxyz)
            if holds:
                known = self._registration
                turn = known.orientation_wxyz
                position_m = _sum(known.position_m, rotate(turn, position_m))
                orientation = multiply(turn, orientation)
                velocity, spin = rotate(turn, velocity), rotate(turn, spin)
            elif tracking == "ok":
                tracking = "unregistered"
            if where.sigma_m is not None and where.sigma_rad is not None:
                sigma_m, sigma_rad = self._sigmas(where, placement, position_m, holds=holds)
        stamp_ns = where.stamp_ns - placement.time_offset_ns
        return ObjectPose(
            object=placement.name,
            serial=serial,
            seq=seq,
            stamp_ns=min(max(stamp_ns, 0), _LATEST_STAMP_NS),
            position_m=_rounded(position_m),
            orientation_wxyz=_rounded_turn(orientation),
            velocity_m_s=_rounded(velocity),
            angular_velocity_rad_s=_rounded(spin),
            tracking=tracking,
            registered=holds,
            sigma_m=sigma_m,
            sigma_rad=sigma_rad,
        )

    def _sigmas(
        self, where: Where, placement: Placement, position_m: Vec3, *, holds: bool
    ) -> tuple[float, float]:
        """Of the tracker, and of the registration as far as objects.json tells it."""
        sigma_m, sigma_rad = where.sigma_m or 0.0, where.sigma_rad or 0.0
        known = self._registration
        turn_rad = known.sigma_rad if holds else 0.0
        shift_m = known.sigma_m if holds else 0.0
        away_m = math.dist(position_m, known.middle_m) if holds and known.middle_m else 0.0
        of_lever_m = sigma_rad * placement.lever_m
        return (
            round(math.hypot(sigma_m, of_lever_m, shift_m, turn_rad * away_m) * _UNITS) / _UNITS,
            round(math.hypot(sigma_rad, turn_rad) * _UNITS) / _UNITS,
        )


def _sum(a: Vec3, b: Vec3) -> Vec3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _rounded(values: Vec3) -> Vec3:
    """To the micrometre (or um/s, urad/s): a thousandth of what lighthouses resolve; no -0.

    As round(x, 6), which writes decimals out and takes four times as long.
    """
    x, y, z = values
    return round(x * _UNITS) / _UNITS, round(y * _UNITS) / _UNITS, round(z * _UNITS) / _UNITS


def _rounded_turn(q: Quat) -> Quat:
    w, x, y, z = normalized(q)
    return (
        round(w * _UNITS) / _UNITS,
        round(x * _UNITS) / _UNITS,
        round(y * _UNITS) / _UNITS,
        round(z * _UNITS) / _UNITS,
    )
