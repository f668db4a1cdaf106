"""Faults of objects and of their trackers. Pure data."""

from __future__ import annotations

from rhot.faults.kind import error, warning

# What the object tracker finds; the subject is an object or a device's serial.
OBJECTS = (
    warning(
        "object_unregistered",
        "an object's tracker is not registered to the rig: its poses are in the lighthouse's frame",
        "register it: `rhot calibrate objects`",
    ),
    warning(
        "registration_stale",
        "the lighthouses' frame has changed since objects were registered: poses may be elsewhere",
        "register again: `rhot calibrate objects`",
    ),
    warning(
        "registration_drift",
        "an object's tracker and the paint on it are not where they were to each other",
        "see that no base station and no camera was moved; then `rhot calibrate objects` again",
    ),
    error(
        "device_twice",
        "two senders publish poses under one serial",
        "let one program read each tracker: stop the other, or unplug its dongle",
    ),
    warning(
        "device_battery",
        "a tracker's battery is nearly empty",
        "charge it",
    ),
    warning(
        "base_station_gone",
        "a base station that SteamVR used is not seen any more",
        "see that it has power and that trackers see it",
    ),
    warning(
        "device_misread",
        "poses of a tracked device cannot be right, and are left out",
        "see that nothing reflects or hides the lighthouses; see its text",
    ),
    warning(
        "device_unknown",
        "a tracked device is none of rig.toml's [[object]] tables",
        "add an [[object]] table with its serial",
    ),
)
