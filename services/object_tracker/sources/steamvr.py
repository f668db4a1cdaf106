"""Poses from a running SteamVR, through the PyPI package openvr (x86 only, imported when needed).

If SteamVR is missing or quits, SourceError says what to do (openvr's own message is empty). A
device that sleeps or is occluded keeps reporting, with bPoseIsValid or bDeviceIsConnected false.
When SteamVR moves its origin the registration is no longer valid: a warning is reported.
"""

from __future__ import annotations

import asyncio
import importlib
import itertools
import math
import re
from collections.abc import AsyncGenerator, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from rhot import clock
from rhot.errors import SourceError
from rhot.messages.objects import OpenVrDevice, OpenVrPose

_CLASSES = {1: "HMD", 2: "Controller", 3: "GenericTracker"}
# ETrackingUniverseOrigin: raw does not follow when the user recentres. EVRApplicationType:
# background does not start SteamVR.
_RAW, _BACKGROUND = 2, 3
_QUIT = 700
# Events after which the origin may be elsewhere.
_MOVED = {
    801: "ChaperoneUniverseHasChanged",
    804: "SeatedZeroPoseReset",
    808: "StandingZeroPoseReset",
}
# Properties cost a call to SteamVR's server each; batteries change slowly.
_DEVICE_REFRESH_S = 2.0
# Digits of float32.
_DIGITS = 7


class SteamVr:
    """Polls every tracked device at rate_hz in a thread of its own.

    report takes the warning about a moved origin.
    """

    def __init__(self, rate_hz: float, report: Callable[[str], None]) -> None:
        self._period_s = 1.0 / rate_hz
        self._report = report

    async def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Poses of headset, controllers and trackers (not of the lighthouses) in SteamVR's raw
        universe.
        """
        loop = asyncio.get_running_loop()
        # One thread for all of openvr: init() takes seconds, and its documentation does not say
        # that several threads may call it.
        with ThreadPoolExecutor(1, "steamvr") as thread:
            poller = await loop.run_in_executor(
                thread, _Poller, lambda text: loop.call_soon_threadsafe(self._report, text)
            )
            try:
                due_s = loop.time()
                while True:
                    for pose in await loop.run_in_executor(thread, poller.poll, loop.time()):
                        yield pose
                    # A poll that took too long is not made up for.
                    due_s = max(due_s + self._period_s, loop.time())
                    await asyncio.sleep(due_s - loop.time())
            finally:
                thread.submit(poller.close)


class _Poller:
    """All calls of openvr."""

    def __init__(self, report: Callable[[str], object]) -> None:
        self._report = report
        self._vr = _import_openvr()
        try:
            self._system = self._vr.init(_BACKGROUND)
        except self._vr.OpenVRError as error:
            raise SourceError(
                f"SteamVR cannot be reached ({type(error).__name__}); install and start SteamVR on"
                " this machine, or choose another [objects] source"
            ) from None
        self._array = (self._vr.TrackedDevicePose_t * self._vr.k_unMaxTrackedDeviceCount)()
        self._event = self._vr.VREvent_t()
        self._devices: dict[int, OpenVrDevice] = {}
        self._refreshed_s = -math.inf
        self._seq = 0

    def close(self) -> None:
        self._vr.shutdown()

    def poll(self, now_s: float) -> list[OpenVrPose]:
        """Every device's pose at this instant."""
        self._handle_events()
        if now_s - self._refreshed_s >= _DEVICE_REFRESH_S:
            self._refreshed_s = now_s
            self._devices = self._read_devices()
        self._system.getDeviceToAbsoluteTrackingPose(_RAW, 0.0, self._array)
        stamp_ns = clock.now_ns()
        poses = [
            openvr_pose(self._array[i], device, self._seq, stamp_ns)
            for i, device in self._devices.items()
        ]
        self._seq += 1
        return poses

    def _handle_events(self) -> None:
        while self._system.pollNextEvent(self._event):
            kind = int(self._event.eventType)
            if kind == _QUIT:
                raise SourceError("SteamVR quit; start it again")
            if kind in _MOVED:
                self._report(
                    f"SteamVR moved its origin ({_MOVED[kind]}): registration is stale;"
                    " run `rhot calibrate objects` again"
                )

    def _read_devices(self) -> dict[int, OpenVrDevice]:
        devices = {}
        for index in range(self._vr.k_unMaxTrackedDeviceCount):
            device_class = _CLASSES.get(int(self._system.getTrackedDeviceClass(index)))
            if device_class is not None:
                devices[index] = self._read_device(index, device_class)
        return devices

    def _read_device(self, index: int, device_class: str) -> OpenVrDevice:
        vr = self._vr
        serial = self._property("String", index, vr.Prop_SerialNumber_String, "")
        charging = self._property("Bool", index, vr.Prop_DeviceIsCharging_Bool, False)
        return OpenVrDevice(
            index=index,
            serial=_key_name(serial, index),
            device_class=device_class,
            model=self._property("String", index, vr.Prop_ModelNumber_String, ""),
            battery=self._property("Float", index, vr.Prop_DeviceBatteryPercentage_Float, -1.0),
            charging=bool(charging),
        )

    def _property(self, kind: str, index: int, prop: int, missing: Any) -> Any:
        try:
            value = getattr(self._system, f"get{kind}TrackedDeviceProperty")(index, prop)
        except (self._vr.OpenVRError, UnicodeDecodeError):
            return missing
        return missing if isinstance(value, float) and not math.isfinite(value) else value


def openvr_pose(tracked: Any, device: OpenVrDevice, seq: int, stamp_ns: int) -> OpenVrPose:
    """A TrackedDevicePose_t as a message; numbers that are not finite make it an invalid pose."""
    rows = [[round(float(v), _DIGITS) for v in row] for row in tracked.mDeviceToAbsoluteTracking.m]
    velocity = [round(float(v), _DIGITS) for v in tracked.vVelocity.v]
    angular_velocity = [round(float(v), _DIGITS) for v in tracked.vAngularVelocity.v]
    finite = all(map(math.isfinite, itertools.chain(*rows, velocity, angular_velocity)))
    if not finite:
        rows, velocity, angular_velocity = [[0.0] * 4] * 3, [0.0] * 3, [0.0] * 3
    return OpenVrPose(
        v=1,
        seq=seq,
        stamp_ns=stamp_ns,
        universe="raw",
        device=device,
        mDeviceToAbsoluteTracking=tuple(map(tuple, rows)),  # type: ignore[arg-type]
        vVelocity=tuple(velocity),  # type: ignore[arg-type]
        vAngularVelocity=tuple(angular_velocity),  # type: ignore[arg-type]
        eTrackingResult=int(tracked.eTrackingResult),
        bPoseIsValid=finite and bool(tracked.bPoseIsValid),
        bDeviceIsConnected=bool(tracked.bDeviceIsConnected),
    )


def _key_name(serial: str, index: int) -> str:
    """A serial as part of a key: other characters become underscores."""
    name = re.sub(r"[^A-Za-z0-9_.-]", "_", serial)[:64]
    return name if re.match(r"[A-Za-z0-9]", name) else f"device{index}"


def _import_openvr() -> Any:
    try:
        return importlib.import_module("openvr")
    except (ImportError, OSError) as error:
        raise SourceError(
            f"the Python package openvr cannot be loaded ({error}); install it with"
            " `pip install 'rhot[openvr]'` on the (x86) machine that runs SteamVR,"
            " or choose another [objects] source"
        ) from None
