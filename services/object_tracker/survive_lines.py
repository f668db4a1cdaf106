"""Parses the text that libsurvive's `survive-cli --record-stdout` prints, and converts its poses to
those of OpenVR.

Pure. Lines of interest (metres, seconds, wxyz, z up):
    t object CONFIG {json}                 the device's own configuration, with its serial number
    t object POSE x y z qw qx qy qz
    t object VELOCITY vx vy vz wx wy wz    follows the POSE of the same instant, usually
    t channel LH_POSE x y z qw qx qy qz id where it has found a lighthouse
    t object DISCONNECT                    the device is gone: unplugged, switched off
    t INFO LOG text                        what libsurvive has to say
Everything else (raw light, IMU) and every malformed line is skipped; malformed POSE lines are
counted. A device that sees no light has no lines of its own.
"""

from __future__ import annotations

import math
import re
import zlib
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.messages import Vec3
from rhot.messages.objects import OpenVrDevice, OpenVrPose

_DEVICE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")
# Lighthouses of the second generation have 16 channels.
_CHANNEL = re.compile(r"1?[0-9]\Z")
_SERIAL = re.compile(r'"device_serial_number"\s*:\s*"([A-Za-z0-9][A-Za-z0-9_.-]{0,63})"')
# libsurvive's z-up world to the `lighthouse` frame of docs/reference/frames.md (x right, y up, -z
# forward): -90 deg about x.
R_LIGHTHOUSE_FROM_SURVIVE: Array = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
# libsurvive names a few devices at most; more names are damaged lines.
_MAX_DEVICES = 64
# libsurvive 1.1.21 prints a pose's VELOCITY in the next line: live 30 us later (110 us at most of
# 454; some ms where the processor was taken from it in between), in a recording at the same time.
_SAME_S = 0.05
# libsurvive rounds to 1e-6; a quaternion whose length is off by more than this is no rotation.
_UNIT_TOLERANCE = 1e-3


@dataclass(frozen=True)
class SurvivePose:
    """One POSE line with its VELOCITY (zero if there was none), in libsurvive's z-up frame.

    time_s counts from the start of survive-cli; serial is the device's own if its CONFIG line came
    before, else its code name. tracking is "lost" for a device without a pose just now, and "gone"
    after its DISCONNECT line; the numbers are then neutral.
    """

    time_s: float
    device: str
    serial: str
    position_m: Vec3
    orientation_wxyz: tuple[float, float, float, float]
    velocity_m_s: Vec3 = (0.0, 0.0, 0.0)
    angular_velocity_rad_s: Vec3 = (0.0, 0.0, 0.0)
    tracking: Literal["ok", "lost", "gone"] = "ok"


def without_pose(
    pose: SurvivePose, time_s: float, tracking: Literal["lost", "gone"]
) -> SurvivePose:
    """The same device at another time, without a pose."""
    return SurvivePose(
        time_s, pose.device, pose.serial, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), tracking=tracking
    )


class SurviveParser:
    """Takes lines, gives poses. A pose waits for the next line, which may be its velocity."""

    def __init__(self) -> None:
        self._serials: dict[str, str] = {}
        self._lighthouses: dict[str, str] = {}
        self._pending: SurvivePose | None = None
        self.malformed = 0

    def feed(self, line: str) -> SurvivePose | None:
        """The pose completed by this line, if any."""
        time, _, rest = line.rstrip().partition(" ")
        device, _, rest = rest.partition(" ")
        word, _, rest = rest.partition(" ")
        if word == "VELOCITY" and self._pending is not None and self._pending.device == device:
            return self._with_velocity(time, rest)
        done, self._pending = self._pending, None
        if word == "POSE":
            self._pending = self._pose(time, device, rest)
            self.malformed += self._pending is None
        elif word == "LH_POSE" and _CHANNEL.match(device):
            self._lighthouses[device] = rest
        elif word == "DISCONNECT":
            self._pending = self._gone(time, device)
        elif (
            word == "CONFIG"
            and _DEVICE.match(device)
            and (device in self._serials or len(self._serials) < _MAX_DEVICES)
        ):
            serial = _SERIAL.search(rest)
            if serial:
                self._serials[device] = serial[1]
        return done

    @property
    def universe(self) -> str:
        """The name of the frame that poses are in: another one when a lighthouse is elsewhere.

        libsurvive's world is where its lighthouses are, and each of its calibrations moves it.
        """
        if not self._lighthouses:
            return "libsurvive"
        places = "\n".join(sorted(f"{name} {rest}" for name, rest in self._lighthouses.items()))
        return f"libsurvive:{zlib.crc32(places.encode('utf-8', 'replace')):08x}"

    def flush(self) -> SurvivePose | None:
        """The pose that is still waiting when the lines end."""
        done, self._pending = self._pending, None
        return done

    def _pose(self, time: str, device: str, rest: str) -> SurvivePose | None:
        numbers = _numbers(f"{time} {rest}", 8)
        if numbers is None or not _DEVICE.match(device):
            return None
        t, x, y, z, qw, qx, qy, qz = numbers
        if t < 0.0 or not abs(math.hypot(qw, qx, qy, qz) - 1.0) < _UNIT_TOLERANCE:
            return None
        return SurvivePose(
            t, device, self._serials.get(device, device), (x, y, z), (qw, qx, qy, qz)
        )

    def _gone(self, time: str, device: str) -> SurvivePose | None:
        numbers = _numbers(time, 1)
        if numbers is None or numbers[0] < 0.0 or not _DEVICE.match(device):
            return None
        serial = self._serials.get(device, device)
        nowhere = SurvivePose(numbers[0], device, serial, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        return without_pose(nowhere, numbers[0], "gone")

    def _with_velocity(self, time: str, rest: str) -> SurvivePose | None:
        done = self.flush()
        numbers = _numbers(f"{time} {rest}", 7)
        if done is None or numbers is None or not 0.0 <= numbers[0] - done.time_s < _SAME_S:
            return done
        if done.tracking != "ok":
            return done
        _, vx, vy, vz, wx, wy, wz = numbers
        return replace(done, velocity_m_s=(vx, vy, vz), angular_velocity_rad_s=(wx, wy, wz))


def _numbers(text: str, count: int) -> list[float] | None:
    words = text.split()
    if len(words) != count:
        return None
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None


class RunClock:
    """Converts libsurvive's run time to wall-clock nanoseconds.

    The smallest (arrival - run time) seen is the offset with the least delay in it. It is taken
    over the current and the previous window, so that it follows a clock that drifts (50 ppm: 0.5 ms
    in 10 s) or is set.
    """

    # Long enough to contain a line without delay, short enough for the drift above.
    WINDOW_NS = 10_000_000_000
    # Arrivals scatter by milliseconds; if one is earlier than its window by more than this, the
    # wall clock was set back.
    BACKWARDS_NS = 1_000_000_000

    def __init__(self) -> None:
        self._window_start_ns: int | None = None
        self._least_ns = 0
        self._previous_ns: int | None = None

    def stamp_ns(self, time_s: float, arrival_ns: int) -> int:
        """The wall clock at run time time_s, for a line that arrived at arrival_ns.

        Never later than arrival_ns.
        """
        time_ns = round(min(time_s, 9e9) * 1e9)
        offset_ns = arrival_ns - time_ns
        age_ns = 0 if self._window_start_ns is None else arrival_ns - self._window_start_ns
        if self._window_start_ns is None or not -self.BACKWARDS_NS < age_ns < 2 * self.WINDOW_NS:
            self._window_start_ns, self._least_ns, self._previous_ns = arrival_ns, offset_ns, None
        elif age_ns >= self.WINDOW_NS:
            self._previous_ns = self._least_ns
            self._window_start_ns, self._least_ns = arrival_ns, offset_ns
        self._least_ns = min(self._least_ns, offset_ns)
        previous_ns = self._least_ns if self._previous_ns is None else self._previous_ns
        return max(0, time_ns + min(self._least_ns, previous_ns))


def openvr_pose(
    pose: SurvivePose, seq: int, stamp_ns: int, universe: str = "libsurvive"
) -> OpenVrPose:
    """The same pose as SteamVR would report it: y up, OpenVR's field names, Running_OK.

    A device without a pose is Running_OutOfRange and not valid, one that is gone not connected
    either.
    """
    R = R_LIGHTHOUSE_FROM_SURVIVE
    rotation = (R @ rotation_from_quaternion(pose.orientation_wxyz)).tolist()
    position = (R @ np.array(pose.position_m)).tolist()
    rows = tuple((*row, p) for row, p in zip(rotation, position, strict=True))
    return OpenVrPose(
        v=1,
        seq=seq,
        stamp_ns=stamp_ns,
        universe=universe,
        device=OpenVrDevice(
            index=0,
            serial=pose.serial,
            device_class="GenericTracker",
            model=pose.device,
            battery=0.0,
            charging=False,
        ),
        mDeviceToAbsoluteTracking=rows,  # type: ignore[arg-type]
        vVelocity=tuple((R @ np.array(pose.velocity_m_s)).tolist()),
        vAngularVelocity=tuple((R @ np.array(pose.angular_velocity_rad_s)).tolist()),
        eTrackingResult=200 if pose.tracking == "ok" else 201,
        bPoseIsValid=pose.tracking == "ok",
        bDeviceIsConnected=pose.tracking != "gone",
    )
