"""Which of SteamVR's events are told, and as what. Pure.

openvr.h has no event for a battery; those come from a property of each device.
"""

from __future__ import annotations

from collections.abc import Mapping

from rhot.clock import Offset
from rhot.messages.objects import OpenVrEvent
from services.openvr_bridge.names import key_name, universe_of
from services.openvr_bridge.sweep import Device, Event

# EVREventType of openvr.h, without VREvent_.
EVENTS = {
    100: "TrackedDeviceActivated",
    101: "TrackedDeviceDeactivated",
    700: "Quit",
    801: "ChaperoneUniverseHasChanged",
    804: "SeatedZeroPoseReset",
    808: "StandingZeroPoseReset",
}
QUIT = 700
# After these a slot is read again at once.
OF_A_DEVICE = (100, 101)
# After these the frame may be another one: every slot is read again.
OF_THE_FRAME = (801, 804, 808)
# SteamVR keeps events for some seconds at most; an older one has no age that can be believed.
_OLDEST_S = 60.0


def event_message(
    event: Event, devices: Mapping[int, Device], polled_ns: int, offset: Offset
) -> OpenVrEvent | None:
    """The event as a message, stamped when it happened; None for one that concerns no pose."""
    name = EVENTS.get(event.kind)
    if name is None:
        return None
    # Written so that NaN fails it.
    age_s = event.age_s if 0.0 <= event.age_s <= _OLDEST_S else 0.0
    about = devices.get(event.slot)
    frame = event.slot if about is not None else min(devices, default=None)
    return OpenVrEvent(
        v=1,
        stamp_ns=max(0, polled_ns - round(age_s * 1e9)),
        event_type=event.kind,
        name=name,
        serial="" if about is None else key_name(about.serial, event.slot),
        universe="raw" if frame is None else universe_of(frame, devices),
        clock_offset_ns=offset.offset_ns,
    )
