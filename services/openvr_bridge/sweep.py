"""What one poll of SteamVR gives: every slot's pose at one instant, who is in which slot, events.

Pure data. SteamVR keeps tracked devices in 64 numbered slots; a device keeps its slot for as long
as SteamVR runs, also while it is switched off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# A numpy record with the fields of TrackedDevicePose_t (numpy reads ctypes structs as they are).
PoseRecords = NDArray[np.void]


@dataclass(frozen=True)
class Device:
    """Who is in a slot.

    serial is as SteamVR tells it, device_class its number (ETrackedDeviceClass). battery is 0..1,
    -1 where it has none; universe_id 0 where it tells none; system is its tracking system's name.
    """

    device_class: int
    serial: str
    model: str = ""
    battery: float = -1.0
    charging: bool = False
    universe_id: int = 0
    system: str = ""


@dataclass(frozen=True)
class Event:
    """A VREvent_t: its number, the slot it is about (2^32 - 1: none), and its age when polled."""

    kind: int
    slot: int
    age_s: float


@dataclass(frozen=True)
class Sweep:
    """One poll. poses has one record a slot; devices who is in it, by slot.

    stamp_ns is CLOCK_REALTIME in the middle of the call that read the poses, which took took_s.
    """

    stamp_ns: int
    poses: PoseRecords
    devices: dict[int, Device]
    events: tuple[Event, ...] = ()
    took_s: float = 0.0
