"""How slots become devices of messages: names that fit into keys, one speaker for each serial, and
the name of the universe that a pose is in. Pure.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping

from rhot.messages.objects import OpenVrDevice
from rhot.plain_text import printable
from services.openvr_bridge.sweep import Device

# ETrackedDeviceClass of openvr.h. Base stations (4) and what redirects a display (5) are left out.
CLASSES = {1: "HMD", 2: "Controller", 3: "GenericTracker"}
BASE_STATION = 4
# Of a text that SteamVR tells.
_LONGEST = 64
# Slots, twice over: a device changes seldom, and is asked for with every pose.
_KEPT = 128


@functools.lru_cache(_KEPT)
def key_name(serial: str, slot: int) -> str:
    """A serial as part of a key: other characters become underscores; device<slot> without any."""
    name = re.sub(r"[^A-Za-z0-9_.-]", "_", serial)[:_LONGEST]
    return name if re.match(r"[A-Za-z0-9]", name) else f"device{slot}"


@functools.lru_cache(_KEPT)
def message_device(slot: int, device: Device) -> OpenVrDevice:
    """What a message says of the device in a slot."""
    known = math.isfinite(device.battery) and 0.0 <= device.battery <= 1.0
    return OpenVrDevice(
        index=slot,
        serial=key_name(device.serial, slot),
        device_class=CLASSES.get(device.device_class, "Invalid"),
        model=printable(device.model)[:_LONGEST],
        battery=round(device.battery, 3) if known else -1.0,
        charging=device.charging,
    )


def speakers(
    devices: Mapping[int, Device], connected: Mapping[int, bool]
) -> tuple[dict[str, int], dict[str, list[int]]]:
    """The slot whose poses are sent for each serial, and the serials that several connected slots
    have (with those slots).

    A connected device counts before one that is switched off; then the lower slot. So a tracker
    that was paired anew takes its old slot's place, and of two that call themselves alike one is
    sent, not both in turn.
    """
    slots: dict[str, list[int]] = {}
    for slot in sorted(devices):
        if devices[slot].device_class in CLASSES:
            slots.setdefault(key_name(devices[slot].serial, slot), []).append(slot)
    first = {
        serial: min(many, key=lambda slot: (not connected.get(slot, False), slot))
        for serial, many in slots.items()
    }
    twice = {
        serial: there
        for serial, many in slots.items()
        if len(there := [slot for slot in many if connected.get(slot, False)]) > 1
    }
    return first, twice


def universe_of(slot: int, devices: Mapping[int, Device]) -> str:
    """The frame of a slot's poses: `raw:<id>`, or `raw` where nobody tells an id.

    SteamVR documents the id for headsets. A device that tells none is in the universe of the first
    slot of its own tracking system that does: a null driver's headset is in none of the
    lighthouses'.
    """
    device = devices[slot]
    if device.universe_id:
        return f"raw:{device.universe_id}"
    for other in sorted(devices):
        if devices[other].universe_id and devices[other].system == device.system:
            return f"raw:{devices[other].universe_id}"
    return "raw"
