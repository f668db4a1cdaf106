"""What is wrong with a camera, told in the service's health once a second, and over when it is.

From its pictures (monitors/), its source (sources/notes.py), the session and the clock. Also says
in words what the tracker does, for systemd.
"""

from __future__ import annotations

import asyncio
import math
import time

from rhot.clock import OffsetEstimator
from rhot.process.service import Service
from services.pi_tracker.endpoints.session_gate import SessionGate
from services.pi_tracker.monitors.camera_monitor import CODES, CameraMonitor
from services.pi_tracker.sources import Source
from services.pi_tracker.tracker import CameraTracker

_PERIOD_S = 1.0
# What starts together with fusion has its session by then, and its clock so long after the session.
_PATIENCE_S = 5.0
# A hand at 0.5 m/s moves 10 mm meanwhile: the master has not answered for minutes.
_MAX_CLOCK_SIGMA_NS = 20_000_000


class CameraFaults:
    """Keeps the faults of one camera in step with what is so; attach() its source once it is open.

    markers is how many of the hands' were found in the last frame.
    """

    def __init__(
        self,
        service: Service,
        tracker: CameraTracker,
        monitor: CameraMonitor,
        gate: SessionGate,
        offset: OffsetEstimator,
    ) -> None:
        self.markers = 0
        self._service, self._tracker, self._monitor = service, tracker, monitor
        self._gate, self._offset = gate, offset
        self._camera = service.instance
        self._source: Source | None = None
        self._began_s = time.monotonic()
        # Since when there is a master.
        self._known_s = math.inf
        self._notes: dict[tuple[str, str], str] = {}

    def attach(self, source: Source) -> None:
        """The source, from now on."""
        self._source, self._began_s = source, time.monotonic()

    async def follow(self) -> None:
        """Tell what is wrong, for ever."""
        while True:
            self._beat()
            await asyncio.sleep(_PERIOD_S)

    def _beat(self) -> None:
        self._tell("session_stopped", self._session_text())
        if self._source is not None:
            found = self._monitor.beat(time.monotonic_ns(), self._source.dropped)
            for code in CODES:
                self._tell(code, found.get(code, ""))
            self._tell("clock_unknown", self._clock_text(self._source))
            self._tell_notes(self._source.notes.standing())
            self._service.values["repeated_frames"] = self._monitor.repeated
        self._service.status = self._status()

    def _tell(self, code: str, text: str) -> None:
        if text:
            self._service.faults.report(code, text, self._camera)
        else:
            self._service.faults.clear(code, self._camera)

    def _tell_notes(self, standing: dict[tuple[str, str], str]) -> None:
        for code, subject in self._notes.keys() - standing.keys():
            self._service.faults.clear(code, subject)
        for (code, subject), text in standing.items():
            self._service.faults.report(code, text, subject)
        self._notes = standing

    def _session_text(self) -> str:
        patient = time.monotonic() - self._began_s < _PATIENCE_S
        if self._gate.running or (not self._gate.known and patient):
            return ""
        if self._gate.known:
            return f"the session is stopped: camera {self._camera!r} sends no markers"
        return (
            f"camera {self._camera!r} waits for the start: nobody has said whether the session "
            "runs; is fusion running?"
        )

    def _clock_text(self, source: Source) -> str:
        # Without a master there is no session either, and one fault is enough.
        if self._gate.known:
            self._known_s = min(self._known_s, time.monotonic())
        if time.monotonic() - max(self._began_s, self._known_s) < _PATIENCE_S:
            return ""
        sigma_ns = self._offset.at(source.now_ns()).sigma_ns
        if sigma_ns < 0:
            return f"the clock of camera {self._camera!r} has never been compared with the master's"
        if sigma_ns > _MAX_CLOCK_SIGMA_NS:
            return (
                f"the clock of camera {self._camera!r} is known to {sigma_ns * 1e-6:.0f} ms only: "
                "the master has not answered for a while"
            )
        return ""

    def _status(self) -> str:
        if not self._gate.running:
            return "waiting: session stopped" if self._gate.known else "waiting for fusion"
        if self._source is None or self._monitor.rate_hz is None:
            return "waiting for pictures"
        colors = self._tracker.wanted(self._tracker.colors)
        config = self._service.config
        wanted = len(config.counted(config.markers_of(colors)))
        return f"{self._monitor.rate_hz:.0f} Hz, {self.markers} of {wanted} markers"
