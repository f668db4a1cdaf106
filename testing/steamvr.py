"""A SteamVR for tests: PyPI's own openvr on a table of functions that answer as SteamVR does.

What is replaced is Valve's compiled client alone. The binding's Python runs as it is: its ctypes
structs, its two calls for a string, its exceptions for error codes.
"""

from __future__ import annotations

import ctypes
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import openvr
from openvr import error_code

IDENTITY = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
NO_SLOT = 0xFFFFFFFF
HMD, CONTROLLER, TRACKER, BASE_STATION, REDIRECT = 1, 2, 3, 4, 5
# ETrackedPropertyError
_WRONG_DEVICE_CLASS, _BUFFER_TOO_SMALL, _UNKNOWN_PROPERTY = 2, 3, 4


@dataclass
class Slot:
    """A device: its pose as SteamVR would tell it, and its properties by number.

    A property that is an int where it should be something else is that error's number.
    """

    device_class: int = TRACKER
    matrix: Sequence[Sequence[float]] = IDENTITY
    velocity: Sequence[float] = (0.0, 0.0, 0.0)
    angular_velocity: Sequence[float] = (0.0, 0.0, 0.0)
    result: int = openvr.TrackingResult_Running_OK
    valid: bool = True
    connected: bool = True
    properties: dict[int, Any] = field(default_factory=dict)
    # Numbers of properties -> ETrackedPropertyError.
    errors: dict[int, int] = field(default_factory=dict)


def device(serial: str | bytes, device_class: int = TRACKER, **properties: Any) -> Slot:
    """A slot of a device with a battery, in universe 7 of the lighthouses."""
    named = {
        "serial": serial,
        "model": "VIVE Tracker 3.0",
        "battery": 0.5,
        "charging": False,
        "universe": 7,
        "system": "lighthouse",
    } | properties
    return Slot(
        device_class,
        properties={
            openvr.Prop_SerialNumber_String: named["serial"],
            openvr.Prop_ModelNumber_String: named["model"],
            openvr.Prop_TrackingSystemName_String: named["system"],
            openvr.Prop_DeviceBatteryPercentage_Float: named["battery"],
            openvr.Prop_DeviceProvidesBatteryStatus_Bool: True,
            openvr.Prop_DeviceIsCharging_Bool: named["charging"],
            openvr.Prop_CurrentUniverseId_Uint64: named["universe"],
        },
    )


class StandIn:
    """SteamVR's state, which tests change; install() puts it behind the module openvr."""

    def __init__(self) -> None:
        self.slots: dict[int, Slot] = {}
        self.init_error: Exception | None = None
        self.poll_s = 0.0
        self.opened = self.closed = self.acknowledged = self.polls = 0
        self.origins: set[tuple[int, float]] = set()
        self.applications: set[int] = set()
        # Set while a poll must not come back.
        self.stuck = threading.Event()
        self._events: deque[tuple[int, int, float]] = deque()
        self._system = object.__new__(openvr.IVRSystem)
        self._kept: list[Any] = []
        self._system.function_table = openvr.IVRSystem_FnTable()
        self._fill_table()

    def happen(self, kind: int, slot: int = NO_SLOT, age_s: float = 0.0) -> None:
        """An event that the next poll finds."""
        self._events.append((kind, slot, age_s))

    def install(self, monkeypatch: Any) -> None:
        """Behind openvr.init() and openvr.shutdown(), for as long as monkeypatch lasts."""
        monkeypatch.setattr(openvr, "init", self._init)
        monkeypatch.setattr(openvr, "shutdown", self._shutdown)

    def _init(self, application: int) -> Any:
        self.applications.add(application)
        if self.init_error is not None:
            raise self.init_error
        self.opened += 1
        return self._system

    def _shutdown(self) -> None:
        self.closed += 1

    def _fill_table(self) -> None:
        answers = {
            "getDeviceToAbsoluteTrackingPose": self._poses,
            "getTrackedDeviceClass": self._class,
            "getBoolTrackedDeviceProperty": self._value,
            "getFloatTrackedDeviceProperty": self._value,
            "getUint64TrackedDeviceProperty": self._value,
            "pollNextEvent": self._next_event,
            "acknowledgeQuit_Exiting": self._acknowledge,
        }
        types = dict(openvr.IVRSystem_FnTable._fields_)
        for name, answer in answers.items():
            self._put(name, types[name](answer))
        # As Python sees it, a char* is a copy of the text: to write there it must be a number.
        string = ctypes.CFUNCTYPE(
            ctypes.c_uint32,
            ctypes.c_uint32,
            openvr.ETrackedDeviceProperty,
            ctypes.c_void_p,
            ctypes.c_uint32,
            ctypes.POINTER(openvr.ETrackedPropertyError),
        )(self._string)
        self._kept.append(string)
        name = "getStringTrackedDeviceProperty"
        self._put(name, ctypes.cast(string, types[name]))

    def _put(self, name: str, function: Any) -> None:
        self._kept.append(function)
        setattr(self._system.function_table, name, function)

    def _poses(self, origin: int, seconds: float, array: Any, count: int) -> None:
        self.polls += 1
        self.origins.add((origin, seconds))
        if self.poll_s:
            time.sleep(self.poll_s)
        while self.stuck.is_set():
            time.sleep(0.01)
        for index in range(count):
            slot = self.slots.get(index)
            array[index] = openvr.TrackedDevicePose_t() if slot is None else pose_struct(slot)

    def _class(self, index: int) -> int:
        slot = self.slots.get(index)
        return 0 if slot is None else slot.device_class

    def _value(self, index: int, prop: int, error: Any) -> Any:
        value, error[0] = self._property(index, prop)
        return value if error[0] == 0 else 0

    def _string(self, index: int, prop: int, buffer: int | None, size: int, error: Any) -> int:
        value, error[0] = self._property(index, prop)
        if error[0]:
            return 0
        text = (value if isinstance(value, bytes) else value.encode()) + b"\0"
        if buffer is None or size < len(text):
            error[0] = _BUFFER_TOO_SMALL
        else:
            ctypes.memmove(buffer, text, len(text))
        return len(text)

    def _property(self, index: int, prop: int) -> tuple[Any, int]:
        slot = self.slots.get(index)
        if slot is None:
            return None, _WRONG_DEVICE_CLASS
        if prop in slot.errors:
            return None, slot.errors[prop]
        value = slot.properties.get(prop)
        return (value, 0) if value is not None else (None, _UNKNOWN_PROPERTY)

    def _next_event(self, event: Any, size: int) -> int:
        assert size == ctypes.sizeof(openvr.VREvent_t)
        if not self._events:
            return 0
        kind, slot, age_s = self._events.popleft()
        event[0].eventType, event[0].trackedDeviceIndex = kind, slot
        event[0].eventAgeSeconds = age_s
        return 1

    def _acknowledge(self) -> None:
        self.acknowledged += 1


def pose_struct(slot: Slot) -> Any:
    """A TrackedDevicePose_t as the binding defines it."""
    pose = openvr.TrackedDevicePose_t()
    for row, values in enumerate(slot.matrix):
        for column, value in enumerate(values):
            pose.mDeviceToAbsoluteTracking.m[row][column] = value
    pose.vVelocity.v[:] = list(slot.velocity)
    pose.vAngularVelocity.v[:] = list(slot.angular_velocity)
    pose.eTrackingResult = slot.result
    pose.bPoseIsValid, pose.bDeviceIsConnected = slot.valid, slot.connected
    return pose


def records(slots: dict[int, Slot]) -> np.ndarray:
    """The 64 records that a poll gives."""
    array = (openvr.TrackedDevicePose_t * openvr.k_unMaxTrackedDeviceCount)()
    for index, slot in slots.items():
        array[index] = pose_struct(slot)
    return np.frombuffer(array, np.dtype(openvr.TrackedDevicePose_t)).copy()


def init_error(name: str) -> Exception:
    """What openvr.init() raises, with its empty message; by the class's name."""
    return getattr(error_code, name)(1)
