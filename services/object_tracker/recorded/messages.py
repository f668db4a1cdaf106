"""Recorded poses as the messages that SteamVR's would be. Pure."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from rhot.messages.objects import OpenVrDevice, OpenVrPose, Row4

# ETrackingResult: Running_OK, Uninitialized.
_OK, _UNINITIALIZED = 200, 1
_NOTHING: Row4 = (0.0, 0.0, 0.0, 0.0)
# Of a table without a word of which of SteamVR's universes it is in.
UNIVERSE = "recorded"


def recorded_pose(
    serial: str, seq: int, stamp_ns: int, T: Array | None, universe: str = UNIVERSE
) -> OpenVrPose:
    """A pose of a recording that keeps no velocity: T is (3, 4), metres, in the lighthouse frame.

    None, or a T that is not finite, gives a message that says it is not valid.
    """
    valid = T is not None and bool(np.all(np.isfinite(T)))
    rows = tuple(map(tuple, T.tolist())) if T is not None and valid else (_NOTHING,) * 3
    return OpenVrPose(
        v=1,
        seq=seq,
        stamp_ns=min(max(stamp_ns, 0), 2**63 - 1),
        universe=universe,
        device=OpenVrDevice(
            index=0,
            serial=serial,
            device_class="GenericTracker",
            model="",
            battery=-1.0,
            charging=False,
        ),
        mDeviceToAbsoluteTracking=rows,  # type: ignore[arg-type]
        vVelocity=(0.0, 0.0, 0.0),
        vAngularVelocity=(0.0, 0.0, 0.0),
        eTrackingResult=_OK if valid else _UNINITIALIZED,
        bPoseIsValid=valid,
        bDeviceIsConnected=True,
    )
