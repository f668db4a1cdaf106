"""The colour ranges in force: from their file, from the bus, watched for drift.

Missing or broken at the start: a recording cannot be tracked and the service ends with the reason;
a live camera starts all the same, with the colours there are, so that it can be calibrated over the
bus. What is put on the bus, or saved by hand, takes effect at once or is refused with a reason in
health; then the old stays.
"""

from __future__ import annotations

import asyncio
import datetime
import logging
import time
from pathlib import Path

import msgspec

from rhot import topics
from rhot.errors import CalibrationError
from rhot.files.calibration import Colors, load_colors, load_lens, save
from rhot.messages import Marker
from rhot.process.service import Service
from services.pi_tracker.colors.light_drift import DriftMonitor
from services.pi_tracker.colors.validate import check_colors
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.step import TrackerStep

# Ranges saved by hand are in force a second later.
_FILE_PERIOD_S = 1.0
# Drift is told again while it lasts, but not every second.
_DRIFT_EVERY_NS = 60_000_000_000

log = logging.getLogger("rhot.pi_tracker")


class Coloring:
    """Holds the tracker's step, and renews it when the colours change.

    Every refused put counts in health's values.
    """

    def __init__(self, service: Service, *, live: bool) -> None:
        self._service = service
        self._camera = service.config.camera_named(service.instance)
        self._path = service.config.calibration_dir / f"{self._camera.name}.colors.json"
        self._told_ns: dict[str, int] = {}
        # What health was last told of colours: with new ones it is no longer so.
        self._complaint = ""
        self._seen_ns = _changed_ns(self._path)
        self.in_force = Colors(colors={})
        service.values["colors_refused"] = 0
        try:
            self._take(load_colors(self._path.parent, self._camera.name))
        except CalibrationError as error:
            if not live:
                raise
            self._start_without(str(error))
        service.bus.answer(topics.COLORS, self._answer, camera=self._camera.name)

    def look(self, frame: Frame, markers: list[Marker]) -> None:
        """Watch for drift."""
        if not self._drift.update(frame, markers):
            return
        self._service.values.update(self._drift.values())
        for drifted in self._drift.drifted():
            if (
                not 0
                <= frame.stamp_ns - self._told_ns.get(drifted.color, -_DRIFT_EVERY_NS)
                < _DRIFT_EVERY_NS
            ):
                self._told_ns[drifted.color] = frame.stamp_ns
                self._complain(drifted.text(self._camera.name))

    async def follow_file(self) -> None:
        """Take what is saved by hand into force, for ever."""
        while True:
            await asyncio.sleep(_FILE_PERIOD_S)
            now_ns = _changed_ns(self._path)
            if now_ns not in (self._seen_ns, 0):
                self._seen_ns = now_ns
                try:
                    colors = load_colors(self._path.parent, self._camera.name)
                    if colors != self.in_force:
                        self._take(colors)
                except CalibrationError as error:
                    self._complain(str(error))

    async def follow_bus(self) -> None:
        """Take what is put on the bus into force and write it to the file, for ever."""
        async for sample in self._service.bus.raw(topics.COLORS, 4, camera=self._camera.name):
            await self._take_put(sample.payload)

    async def _take_put(self, payload: bytes) -> None:
        made = ""
        try:
            colors = msgspec.json.decode(payload, type=Colors)
            made = f" of {colors.date} by {colors.tool}"
            if not colors.date:
                colors = msgspec.structs.replace(
                    colors, date=datetime.datetime.now().astimezone().isoformat(timespec="seconds")
                )
            # Colours may come one after the other, but none that is tracked may go.
            check_colors(
                colors,
                [name for name in self._service.config.colors if name in self.in_force.colors],
            )
            step = self._made(colors, self._there(colors))
            try:
                await asyncio.to_thread(save, self._path, colors)
            except OSError as error:
                raise CalibrationError(f"{self._path} cannot be written: {error}") from None
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, CalibrationError) as error:
            self._service.values["colors_refused"] += 1
            self._complain(
                f"colours{made[:120]} put on the bus for camera {self._camera.name!r} are refused: {error}"
            )
            return
        self._seen_ns = _changed_ns(self._path)
        self._put_in_force(colors, step)
        missing = [name for name in self._service.config.colors if name not in colors.colors]
        if missing:
            self._complain(
                f"camera {self._camera.name!r}: {', '.join(missing)} not calibrated yet, and not tracked until then"
            )
        log.info("new colours in force%s: %s", made[:120], ", ".join(sorted(colors.colors)))

    def _take(self, colors: Colors) -> None:
        """Into force with the next frame; raises CalibrationError and keeps the old."""
        # Without a hand nobody says which colours matter: all of them do.
        self._put_in_force(
            colors, self._made(colors, self._service.config.colors or sorted(colors.colors))
        )

    def _start_without(self, reason: str) -> None:
        """Into force: those of the wanted colours that there are, none if need be."""
        try:
            colors = load_colors(self._path.parent, self._camera.name)
        except CalibrationError:
            colors = Colors(colors={})
        there = self._there(colors)
        self._put_in_force(colors, self._made(colors, there))
        self._complain(f"{reason}. Until then {', '.join(there) or 'nothing'} is tracked")

    def _there(self, colors: Colors) -> list[str]:
        """Those of the wanted colours that there are; without a hand, all."""
        return [
            name
            for name in self._service.config.colors or sorted(colors.colors)
            if name in colors.colors
        ]

    def _made(self, colors: Colors, wanted: list[str]) -> TrackerStep:
        config = self._service.config
        name, size_px = self._camera.name, self._camera.size_px
        lens = load_lens(config.calibration_dir, name) if config.tracker.rectify else None
        return TrackerStep(
            name, colors, config.tracker, size_px, wanted, time.perf_counter_ns, self._path, lens
        )

    def _put_in_force(self, colors: Colors, step: TrackerStep) -> None:
        self.in_force, self.step, self._drift = colors, step, DriftMonitor(colors)
        self._told_ns.clear()
        if self._service.last_error == self._complaint:
            self._service.last_error = ""
        for name in [
            name for name in self._service.values if name.endswith(("_hue_off", "_outside"))
        ]:
            del self._service.values[name]

    def _complain(self, text: str) -> None:
        """In health until other colours are in force."""
        self._service.error(text)
        self._complaint = self._service.last_error

    def _answer(self) -> Colors:
        return self.in_force


def _changed_ns(path: Path) -> int:
    """Time of the last change, 0 while there is no such file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
