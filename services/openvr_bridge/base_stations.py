"""Base stations that moved or vanished, by their own poses in SteamVR's raw universe. Pure.

SteamVR keeps base stations where it found them; one that is moved is found again elsewhere, and
everything that was registered before is then off. In another universe all of them are elsewhere:
that is told by the universe's name, and not here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from services.openvr_bridge.names import BASE_STATION, key_name, universe_of
from services.openvr_bridge.sweep import Sweep

# Beyond what SteamVR corrects by itself in a session, and less than what anybody moves by hand; not
# measured on hardware of ours.
_MOVED_M, _TURNED_RAD = 0.02, math.radians(1.0)
# Serials that are remembered; a room has four.
_MAX_STATIONS = 32


@dataclass
class _Station:
    universe: str
    first: np.ndarray  # (3, 4), where it was first seen
    told: str = ""


class BaseStations:
    """Where base stations were when the bridge first saw them."""

    def __init__(self) -> None:
        self._stations: dict[str, _Station] = {}

    def look(self, sweep: Sweep) -> tuple[dict[str, str], dict[str, str]]:
        """(those that moved, those that are gone), what is wrong by serial."""
        moved, gone = {}, {}
        for slot, device in sweep.devices.items():
            if device.device_class != BASE_STATION:
                continue
            serial, record = key_name(device.serial, slot), sweep.poses[slot]
            matrix = record["mDeviceToAbsoluteTracking"]["m"].astype(float)
            if not record["bDeviceIsConnected"]:
                if serial in self._stations:
                    gone[serial] = f"base station {serial} is not seen any more"
            elif record["bPoseIsValid"] and np.isfinite(matrix).all():
                self._take(serial, universe_of(slot, sweep.devices), matrix)
            if serial in self._stations and self._stations[serial].told:
                moved[serial] = self._stations[serial].told
        return moved, gone

    def _take(self, serial: str, universe: str, matrix: np.ndarray) -> None:
        station = self._stations.get(serial)
        if station is None or station.universe != universe:
            if station is not None or len(self._stations) < _MAX_STATIONS:
                self._stations[serial] = _Station(universe, matrix)
            return
        distance_m = float(np.linalg.norm(matrix[:, 3] - station.first[:, 3]))
        # The angle of R_first^T R, from its trace.
        cosine = (np.sum(matrix[:, :3] * station.first[:, :3]) - 1.0) / 2.0
        turned_rad = math.acos(min(1.0, max(-1.0, float(cosine))))
        if distance_m > _MOVED_M or turned_rad > _TURNED_RAD:
            station.told = (
                f"base station {serial} is {1000 * distance_m:.0f} mm and"
                f" {math.degrees(turned_rad):.1f} deg from where it was"
            )
        else:
            station.told = ""
