"""Whether poses are still in the frame that objects were registered in. Pure.

The universe of a pose names its frame; another name is another frame. Event 801 says that the frame
itself has moved. Either way the registration no longer holds, until objects.json is made anew: the
service starts again with it. Nothing tells that a frame that has moved came back.
"""

from __future__ import annotations

from rhot.messages.objects import OpenVrEvent

# ChaperoneUniverseHasChanged: the frame of all raw poses is another one.
_MOVED = 801
# SeatedZeroPoseReset, StandingZeroPoseReset: they move the seated and the standing origin. Raw
# poses, which rhot takes, do not follow them (openvr.h, TrackingUniverseRawAndUncalibrated).
_RESET = {804: "SeatedZeroPoseReset", 808: "StandingZeroPoseReset"}


class FrameWatch:
    """Compares frames with the registered one; `universe` is Objects.universe, "" if unknown."""

    def __init__(self, universe: str) -> None:
        self._registered = universe
        self._stale: dict[str, str] = {}
        self._moved = ""

    def holds(self, serial: str, universe: str) -> bool:
        """Whether the registration holds for a pose of that device (one that rig.toml names)."""
        if not self._registered:
            self._registered = universe
        if not _same(universe, self._registered) and serial not in self._stale:
            self._stale[serial] = (
                f"{serial} is now in universe {universe[:40]!r}, registered was"
                f" {self._registered[:40]!r}"
            )
        return not self._moved and serial not in self._stale

    def event(self, event: OpenVrEvent) -> str | None:
        """Takes in an event of SteamVR; a warning where it is none that moves raw poses."""
        if event.event_type == _MOVED:
            self._moved = f"SteamVR's universe has changed ({event.event_type})"
        name = _RESET.get(event.event_type)
        if name is None:
            return None
        return (
            f"SteamVR's origin was reset ({name}, {event.event_type}): raw poses do not move with"
            " it, and the registration holds"
        )

    def texts(self) -> dict[str, str]:
        """Why the registration does not hold, by device; "" is all of them."""
        return dict(self._stale) | ({"": self._moved} if self._moved else {})


def _same(universe: str, other: str) -> bool:
    """Whether two names may be one frame: "raw" is any raw one, as "" is any at all."""
    if universe == other or not universe or not other:
        return True
    return universe.startswith(f"{other}:") or other.startswith(f"{universe}:")
