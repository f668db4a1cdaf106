"""Poses and rigs for the object tracker's tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
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
