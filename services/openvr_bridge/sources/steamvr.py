"""A running SteamVR, through the PyPI package openvr (x86 only, imported when needed).

All calls of openvr are made from one thread. What is wrong is a SourceError that says what to do;
openvr's own messages are empty. Base stations are read as well: they cost nothing more.
"""

from __future__ import annotations

import contextlib
import importlib
import math
from typing import Any

import numpy as np

from rhot import clock
from rhot.errors import SourceError
from services.openvr_bridge.events import OF_A_DEVICE, OF_THE_FRAME
from services.openvr_bridge.sweep import Device, Event, Sweep

# ETrackingUniverseOrigin: raw does not follow when the user recentres. EVRApplicationType:
# background does not start SteamVR, and needs no headset by itself.
_RAW, _BACKGROUND = 2, 3
_NO_DEVICE = 0
# A flood of events must not keep poses waiting; what is left comes with the next sweep.
_EVENTS_A_SWEEP = 64
_GUIDE = "docs/guide/steamvr.md"
# What to do about some of openvr's InitErrors, by a part of their class's name.
_ADVICE = {
    "PathRegistryNotFound": "SteamVR was never started by this user; install it and start it once",
    "InstallationNotFound": "SteamVR is not installed for this user",
    "NoServerForBackgroundApp": "SteamVR does not run; start it",
    "HmdNotFound": f"SteamVR wants a headset; {_GUIDE} says how it goes without",
}


class SteamVr:
    """One connection; sweep() as often as one likes, close() at the end.

    Raises SourceError if openvr is not installed or SteamVR cannot be reached.
    """

    def __init__(self) -> None:
        self._vr = _import_openvr()
        self._system = self._open()
        count = int(self._vr.k_unMaxTrackedDeviceCount)
        self._array = (self._vr.TrackedDevicePose_t * count)()
        # The same memory, as numpy sees it.
        self._records = np.frombuffer(self._array, np.dtype(self._vr.TrackedDevicePose_t))
        self._event = self._vr.VREvent_t()
        self._devices: dict[int, Device] = {}
        self._next_slot = 0
        self._read_slots(range(count))

    def close(self) -> None:
        """End the connection; SteamVR ends those who stay after it has quit."""
        with contextlib.suppress(self._vr.OpenVRError, OSError):
            self._vr.shutdown()

    def sweep(self) -> Sweep:
        """Every slot's pose at this instant, predicted by nothing."""
        events = self._poll_events()
        # One slot a sweep: each property is a call to SteamVR's server, and all of them at once
        # would keep poses waiting.
        self._read_slots([self._next_slot])
        self._next_slot = (self._next_slot + 1) % len(self._array)
        before_ns = clock.now_ns()
        self._system.getDeviceToAbsoluteTrackingPose(_RAW, 0.0, self._array)
        after_ns = clock.now_ns()
        return Sweep(
            stamp_ns=(before_ns + after_ns) // 2,
            poses=self._records.copy(),
            devices=dict(self._devices),
            events=tuple(events),
            took_s=max(0, after_ns - before_ns) * 1e-9,
        )

    def acknowledge_quit(self) -> None:
        """Say that the quit was heard: SteamVR waits a little then."""
        with contextlib.suppress(self._vr.OpenVRError, OSError):
            self._system.acknowledgeQuit_Exiting()

    def _open(self) -> Any:
        try:
            return self._vr.init(_BACKGROUND)
        # KeyError: a number that this version of openvr has no class for.
        except (self._vr.OpenVRError, KeyError) as error:
            name = type(error).__name__ if isinstance(error, self._vr.OpenVRError) else str(error)
            advice = next(
                (text for part, text in _ADVICE.items() if part in name),
                "install and start SteamVR on this machine",
            )
            raise SourceError(
                f"SteamVR cannot be reached ({name}): {advice}; it is tried again"
            ) from None

    def _poll_events(self) -> list[Event]:
        found: list[Event] = []
        while len(found) < _EVENTS_A_SWEEP and self._system.pollNextEvent(self._event):
            told = self._event
            found.append(
                Event(int(told.eventType), int(told.trackedDeviceIndex), told.eventAgeSeconds)
            )
        again = {event.slot for event in found if event.kind in OF_A_DEVICE}
        if any(event.kind in OF_THE_FRAME for event in found):
            again.update(self._devices)
        self._read_slots(slot for slot in sorted(again) if slot < len(self._array))
        return found

    def _read_slots(self, slots: Any) -> None:
        for slot in slots:
            device_class = int(self._system.getTrackedDeviceClass(slot))
            if device_class == _NO_DEVICE:
                self._devices.pop(slot, None)
            else:
                self._devices[slot] = self._read_device(slot, device_class)

    def _read_device(self, slot: int, device_class: int) -> Device:
        """What does not answer now keeps what it said before."""
        vr = self._vr
        before = self._devices.get(slot)
        if before is None or before.device_class != device_class:
            before = Device(device_class, "")
        # Without the property it is tried: a battery that is not there is an error, too.
        powered = self._property("Bool", slot, vr.Prop_DeviceProvidesBatteryStatus_Bool, True)
        battery = self._property("Float", slot, vr.Prop_DeviceBatteryPercentage_Float, -1.0)
        return Device(
            device_class=device_class,
            serial=self._property("String", slot, vr.Prop_SerialNumber_String, before.serial),
            model=self._property("String", slot, vr.Prop_ModelNumber_String, before.model),
            battery=battery if powered and math.isfinite(battery) else -1.0,
            charging=bool(self._property("Bool", slot, vr.Prop_DeviceIsCharging_Bool, False)),
            universe_id=self._property(
                "Uint64", slot, vr.Prop_CurrentUniverseId_Uint64, before.universe_id
            ),
            system=self._property("String", slot, vr.Prop_TrackingSystemName_String, before.system),
        )

    def _property(self, kind: str, slot: int, prop: int, missing: Any) -> Any:
        read = getattr(self._system, f"get{kind}TrackedDeviceProperty")
        try:
            return read(slot, prop)
        # KeyError: an error's number that this version of openvr has no class for.
        except (self._vr.OpenVRError, KeyError, UnicodeDecodeError):
            return missing


def _import_openvr() -> Any:
    try:
        return importlib.import_module("openvr")
    except (ImportError, OSError) as error:
        raise SourceError(
            f"the Python package openvr cannot be loaded ({error}); install it with"
            " `pip install 'rhot[openvr]'` on the (x86) machine that runs SteamVR, and run"
            " rhot-openvr-bridge there"
        ) from None
