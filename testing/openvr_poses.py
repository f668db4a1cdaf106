"""What SteamVR says of a tracker: of one that is well, and any field can be another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rhot.files.calibration import Objects
from rhot.geometry.transforms import Array
from rhot.messages.objects import OpenVrDevice, OpenVrPose

_HERE = np.eye(4)


def registered(**fields: Any) -> Objects:
    """A registration that has the lighthouse frame as the rig's; any other field."""
    rows: Any = tuple(tuple(row) for row in _HERE.tolist())
    return Objects(T_rig_from_lighthouse=rows, **fields)


def openvr_pose(
    T: Array | Sequence[Sequence[float]] = _HERE, serial: str = "LHR-1", **fields: Any
) -> OpenVrPose:
    """A tracker at T_lighthouse_from_tracker, (3, 4) or (4, 4), metres; still unless told."""
    rows = T.tolist() if isinstance(T, np.ndarray) else T
    values: dict[str, Any] = {
        "v": 1,
        "seq": 7,
        "stamp_ns": 1_700_000_000_000_000_000,
        "universe": "test",
        "device": OpenVrDevice(
            index=3,
            serial=serial,
            device_class="GenericTracker",
            model="VIVE Tracker 3.0",
            battery=0.5,
            charging=False,
        ),
        "mDeviceToAbsoluteTracking": tuple(tuple(row) for row in rows[:3]),
        "vVelocity": (0.0, 0.0, 0.0),
        "vAngularVelocity": (0.0, 0.0, 0.0),
        "eTrackingResult": 200,
        "bPoseIsValid": True,
        "bDeviceIsConnected": True,
    }
    return OpenVrPose(**(values | fields))
