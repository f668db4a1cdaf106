"""The clocks of the simulated camera computers, which somebody may set while the rig runs.

A camera's clock has errors of its own (camera_clock.py); what is set here comes on top, as if
somebody set the time of that computer. It does not outlive the simulator. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from rhot.messages.simulator import SimClock


class ComputerClocks:
    """How far each computer's clock was set ahead of where its own errors have it."""

    def __init__(self, cameras: Iterable[str]) -> None:
        self._ahead_ns = dict.fromkeys(cameras, 0)

    def ahead_ns(self, camera: str) -> int:
        """How far that camera's computer was set ahead; negative: back."""
        return self._ahead_ns[camera]

    async def answer(self, camera: str, payload: bytes) -> SimClock:
        """What holds, after the change that a request asks for.

        Raises msgspec.DecodeError for a payload that is no SimClock.
        """
        if payload:
            self._ahead_ns[camera] = msgspec.json.decode(payload, type=SimClock).ahead_ns
        return SimClock(ahead_ns=self._ahead_ns[camera])
