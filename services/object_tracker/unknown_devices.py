"""Devices whose poses arrive though rig.toml names none of them: named while they come. Pure."""

from __future__ import annotations

# A device is gone once it has been silent for so long; SteamVR's send many poses a second.
_GONE_S = 5.0
# A room has a few devices; serials come from the network, and must not fill the memory.
_MAX_DEVICES = 16


class UnknownDevices:
    """The serials heard lately."""

    def __init__(self) -> None:
        self._heard_s: dict[str, float] = {}

    def note(self, serial: str, now_s: float) -> None:
        """A pose of that device came; now_s is a monotonic clock."""
        if serial in self._heard_s or len(self._heard_s) < _MAX_DEVICES:
            self._heard_s[serial] = now_s

    def texts(self, now_s: float) -> dict[str, str]:
        """What is wrong, by serial."""
        self._heard_s = {
            serial: heard_s
            for serial, heard_s in self._heard_s.items()
            if now_s - heard_s < _GONE_S
        }
        return {
            serial: f"device {serial} is no [[object]] of rig.toml: its poses are ignored"
            for serial in self._heard_s
        }
