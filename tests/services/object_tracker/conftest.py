"""Poses, rigs and a fake SteamVR for the object tracker's tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.geometry.transforms import Array
from rhot.messages.objects import OpenVrDevice, OpenVrPose


@pytest.fixture
def config() -> RigConfig:
    """A rig with one object, `cup`, on the tracker LHR-1."""
    return RigConfig(object=[ObjectTable(name="cup", serial="LHR-1")])


@pytest.fixture
def make_pose() -> Callable[..., OpenVrPose]:
    """An OpenVrPose of LHR-1 at a (4, 4) transform, any field replaceable."""

    def make(T: Array | None = None, serial: str = "LHR-1", **fields: Any) -> OpenVrPose:
        T = np.eye(4) if T is None else T
        values: dict[str, Any] = {
            "v": 1,
            "seq": 7,
            "stamp_ns": 1_700_000_000_000_000_000,
            "universe": "test",
            "device": OpenVrDevice(
                index=3,
                serial=serial,
                device_class="GenericTracker",
                model="Tracker 3.0",
                battery=0.5,
                charging=False,
            ),
            "mDeviceToAbsoluteTracking": tuple(tuple(row) for row in T[:3].tolist()),
            "vVelocity": (0.0, 0.0, 0.0),
            "vAngularVelocity": (0.0, 0.0, 0.0),
            "eTrackingResult": 200,
            "bPoseIsValid": True,
            "bDeviceIsConnected": True,
        }
        return OpenVrPose(**(values | fields))

    return make


@pytest.fixture
def vive(rhot_data: Path) -> Path:
    """The real lighthouse recordings."""
    return rhot_data / "vive"


class FakeVrError(Exception):
    """Stands for openvr.OpenVRError, with its empty message."""


class FakeSystem:
    """IVRSystem with one tracker (slot 2) and one lighthouse (slot 1)."""

    def __init__(self, vr: SimpleNamespace) -> None:
        self.vr = vr
        self.events: list[int] = []
        self.matrix = [[1.0, 0.0, 0.0, 0.1], [0.0, 1.0, 0.0, 0.2], [0.0, 0.0, 1.0, 0.3]]
        self.serial = "LHR-1"

    def pollNextEvent(self, event: Any) -> bool:  # noqa: N802
        if not self.events:
            return False
        event.eventType = self.events.pop(0)
        return True

    def getTrackedDeviceClass(self, index: int) -> int:  # noqa: N802
        return {1: 4, 2: 3}.get(index, 0)

    def getStringTrackedDeviceProperty(self, index: int, prop: int) -> str:  # noqa: N802
        return self.serial if prop == self.vr.Prop_SerialNumber_String else "VIVE Tracker 3.0"

    def getFloatTrackedDeviceProperty(self, index: int, prop: int) -> float:  # noqa: N802
        raise FakeVrError

    def getBoolTrackedDeviceProperty(self, index: int, prop: int) -> bool:  # noqa: N802
        return False

    def getDeviceToAbsoluteTrackingPose(  # noqa: N802
        self, origin: int, seconds: float, array: list[Any]
    ) -> None:
        array[2].mDeviceToAbsoluteTracking.m = self.matrix


class _FakePose(SimpleNamespace):
    """TrackedDevicePose_t; `_FakePose * n` makes an array type, as ctypes does."""

    def __init__(self) -> None:
        super().__init__(
            mDeviceToAbsoluteTracking=SimpleNamespace(m=[[0.0] * 4] * 3),
            vVelocity=SimpleNamespace(v=[0.1, 0.0, 0.0]),
            vAngularVelocity=SimpleNamespace(v=[0.0, 0.2, 0.0]),
            eTrackingResult=200,
            bPoseIsValid=True,
            bDeviceIsConnected=True,
        )


class _PoseType:
    def __mul__(self, count: int) -> Callable[[], list[_FakePose]]:
        return lambda: [_FakePose() for _ in range(count)]


@pytest.fixture
def fake_vr(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A module in place of openvr; .system is its FakeSystem, .closed counts shutdown()."""
    vr = SimpleNamespace(
        OpenVRError=FakeVrError,
        TrackedDevicePose_t=_PoseType(),
        VREvent_t=lambda: SimpleNamespace(eventType=0),
        k_unMaxTrackedDeviceCount=4,
        Prop_SerialNumber_String=1002,
        Prop_ModelNumber_String=1001,
        Prop_DeviceBatteryPercentage_Float=1012,
        Prop_DeviceIsCharging_Bool=1011,
        closed=0,
    )
    vr.system = FakeSystem(vr)
    vr.init = lambda _application: vr.system

    def shutdown() -> None:
        vr.closed += 1

    vr.shutdown = shutdown
    monkeypatch.setitem(__import__("sys").modules, "openvr", vr)
    return vr
