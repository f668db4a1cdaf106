"""One sweep in, the messages of its devices and events out. Pure.

Numbers that are not finite make a pose invalid and are sent as zeros: JSON has no NaN. What
SteamVR calls invalid, disconnected or not tracking is sent as it is: who receives decides.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rhot.clock import Offset
from rhot.messages.objects import OpenVrEvent, OpenVrPose
from services.openvr_bridge.events import event_message
from services.openvr_bridge.names import message_device, speakers, universe_of
from services.openvr_bridge.sweep import Sweep

# Digits after the point: 0.1 um, and what float32 has of a rotation.
_DIGITS = 7
# Names whose messages are counted; SteamVR has 64 slots, and serials that change with each sweep
# are no devices.
_MAX_NAMES = 256


class BridgeStep:
    """Turns sweeps into messages; seq counts the messages of each serial.

    twice has the slots of each serial that several connected devices have, as of the last sweep.
    """

    def __init__(self) -> None:
        self._seq: dict[str, int] = {}
        self.twice: dict[str, list[int]] = {}

    def poses(self, sweep: Sweep, offset: Offset) -> list[OpenVrPose]:
        """A message for each serial; offset is the sender's clock minus the master's."""
        flags = sweep.poses["bDeviceIsConnected"].astype(bool).tolist()
        first, self.twice = speakers(sweep.devices, dict(enumerate(flags)))
        slots = list(first.values())
        if not slots:
            return []
        records = sweep.poses[slots]
        numbers = _Numbers(records)
        found = []
        for row, (serial, slot) in enumerate(first.items()):
            seq = self._seq.get(serial, 0)
            if seq == 0 and len(self._seq) >= _MAX_NAMES:
                continue
            self._seq[serial] = seq + 1
            found.append(
                OpenVrPose(
                    v=1,
                    seq=seq,
                    stamp_ns=max(0, sweep.stamp_ns),
                    universe=universe_of(slot, sweep.devices),
                    device=message_device(slot, sweep.devices[slot]),
                    bDeviceIsConnected=flags[slot],
                    clock_offset_ns=offset.offset_ns,
                    clock_sigma_ns=offset.sigma_ns,
                    **numbers.of(row),
                )
            )
        return found

    def events(self, sweep: Sweep, offset: Offset) -> list[OpenVrEvent]:
        """A message for each event that concerns poses."""
        told = (event_message(e, sweep.devices, sweep.stamp_ns, offset) for e in sweep.events)
        return [message for message in told if message is not None]


class _Numbers:
    """The numbers of all records at once: numpy rounds 64 devices as quickly as one."""

    def __init__(self, records: np.ndarray) -> None:
        matrix = records["mDeviceToAbsoluteTracking"]["m"].astype(np.float64)  # (n, 3, 4)
        speeds = np.stack(
            [records["vVelocity"]["v"], records["vAngularVelocity"]["v"]], axis=1
        ).astype(np.float64)  # (n, 2, 3)
        finite = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(speeds).all(axis=(1, 2))
        matrix[~finite] = 0.0
        speeds[~finite] = 0.0
        # + 0.0 turns -0 into 0.
        self._matrix = (matrix.round(_DIGITS) + 0.0).tolist()
        self._speeds = (speeds.round(_DIGITS) + 0.0).tolist()
        self._results = records["eTrackingResult"].tolist()
        self._valid = (finite & records["bPoseIsValid"].astype(bool)).tolist()

    def of(self, row: int) -> dict[str, Any]:
        """Valve's fields of one record."""
        velocity, angular_velocity = self._speeds[row]
        return {
            "mDeviceToAbsoluteTracking": tuple(map(tuple, self._matrix[row])),
            "vVelocity": tuple(velocity),
            "vAngularVelocity": tuple(angular_velocity),
            "eTrackingResult": self._results[row],
            "bPoseIsValid": self._valid[row],
        }
