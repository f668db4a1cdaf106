"""Whose battery is nearly empty. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from rhot.messages.objects import OpenVrDevice

# Of 1; a Vive tracker lasts some hours: half an hour is left. Over once it is well above, or a
# percentage that trembles would come and go.
_LOW, _ENOUGH = 0.15, 0.20


class Batteries:
    """Remembers who was low, to tell its end a little later."""

    def __init__(self) -> None:
        self._low: set[str] = set()

    def texts(self, devices: Iterable[OpenVrDevice]) -> dict[str, str]:
        """What is wrong now, by serial; who charges, or has no battery, is well."""
        found = {}
        for device in devices:
            limit = _ENOUGH if device.serial in self._low else _LOW
            if 0.0 <= device.battery < limit and not device.charging:
                share = round(100 * device.battery)
                found[device.serial] = f"the battery of {device.serial} is at {share} %"
        self._low = set(found)
        return found
