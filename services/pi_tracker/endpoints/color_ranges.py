"""The camera's colour ranges over the bus and in their file: asked for, changed, watched for drift.

Missing or broken at the start: a recording cannot be tracked, and the service ends with the reason;
a live camera starts all the same, with the colours there are, so that it can be calibrated over the
bus. A change takes effect with the next frame and is written to the file, or it is refused and the
old ranges stay: who asked by a query gets a typed Refusal, who put or saved a file finds the reason
in health.
"""

from __future__ import annotations

import asyncio
import datetime
import logging
from pathlib import Path

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE, CalibrationError, RefusalCode, RefusedError
from rhot.files.calibration import Colors, load_colors
from rhot.process.service import Service
from services.pi_tracker.colors.light_drift import Drifted
from services.pi_tracker.colors.validate import check_colors, check_nesting
from services.pi_tracker.endpoints.latest_change import LatestChange, write_setting
from services.pi_tracker.endpoints.refusals import Refusals
from services.pi_tracker.tracker import CameraTracker

# Ranges saved by hand are used a second later.
_FILE_PERIOD_S = 1.0

log = logging.getLogger("rhot.pi_tracker")


class ColorRanges:
    """Keeps a tracker's ranges in step with their file and with what is asked for on the bus.

    Every refusal counts in health's values.
    """

    def __init__(self, service: Service, tracker: CameraTracker, *, live: bool) -> None:
        self._service, self._tracker = service, tracker
        self._camera, self._path = tracker.camera.name, tracker.colors_path
        # What health was last told of colours: with new ones it is no longer so.
        self._file_ns = _modified_ns(self._path)
        # One change at a time: the file and the tracker must agree on the last.
        self._changes = LatestChange(self._check_and_use)
        self._refusals = Refusals(service, "colors")
        try:
            self._use_file()
        except CalibrationError as error:
            if not live:
                raise
            self._start_without(str(error))
        service.bus.answer_requests(topics.COLORS, self._answer, camera=self._camera)

    def tell_drift(self, drifted: list[Drifted]) -> None:
        """Say in health which colours have drifted: these, and no others any more."""
        self._service.faults.replace(
            "color_drifted",
            {one.color: self._drift_text(one) for one in drifted},
            {one.color: f"run `rhot calibrate colors {self._camera}`" for one in drifted},
        )

    def _drift_text(self, one: Drifted) -> str:
        wearer = self._service.config.wearer(one.color)
        return f"{one.text(self._camera)} ({wearer})" if wearer else one.text(self._camera)

    async def follow_file(self) -> None:
        """Use what is saved by hand, for ever."""
        while True:
            await asyncio.sleep(_FILE_PERIOD_S)
            now_ns = _modified_ns(self._path)
            if now_ns not in (self._file_ns, 0):
                self._file_ns = now_ns
                try:
                    self._use_file()
                except CalibrationError as error:
                    self._report(str(error))

    async def follow_bus(self) -> None:
        """Use what is put on the bus, for ever. A put has no reply: refusals go to health."""
        async for sample in self._service.bus.raw(topics.COLORS, 4, camera=self._camera):
            try:
                await self._change(sample.payload)
            except RefusedError as error:
                self._refusals.tell(error)

    async def _answer(self, payload: bytes) -> Colors:
        """The ranges in use, after the change that the payload asks for."""
        if payload:
            await self._change(payload)
        return self._tracker.colors

    async def _change(self, payload: bytes) -> None:
        made_by = ""
        try:
            colors = _dated(msgspec.json.decode(payload, type=Colors))
            made_by = f" of {colors.date} by {colors.tool}"[:120]
            self._check(colors)
            await self._changes.make(colors)
        except RefusedError as error:
            raise self._refusal(made_by, error.code, error) from None
        except CalibrationError as error:
            raise self._refusal(made_by, "invalid", error) from None
        except UNDECODABLE as error:
            raise self._refusal(made_by, "malformed", error) from None

    def _check(self, colors: Colors) -> None:
        """Raises CalibrationError."""
        # Colours may come one after the other, but none that is tracked may go.
        there = self._tracker.colors.colors
        check_colors(colors, [name for name in self._service.config.colors if name in there])

    async def _check_and_use(self, colors: Colors) -> None:
        tracker = self._tracker
        # Others may have come since they were checked.
        self._check(colors)
        step = tracker.prepare(colors, tracker.calibrated(colors))
        try:
            await asyncio.to_thread(write_setting, self._path, colors)
        except OSError as error:
            raise RefusedError(f"{self._path} cannot be written: {error}", "not_saved") from None
        self._file_ns = _modified_ns(self._path)
        tracker.use(colors, step)
        self._forget_problems()
        names = ", ".join(sorted(colors.colors))
        log.info("new colours of %s by %s: %s", colors.date[:60], colors.tool[:60], names)
        config = self._service.config
        missing = [
            f"{name} ({config.wearer(name)})" for name in config.colors if name not in colors.colors
        ]
        if missing:
            self._report(
                f"camera {self._camera!r}: {', '.join(missing)} not calibrated yet, "
                "and not tracked until then"
            )

    def _refusal(self, made_by: str, code: RefusalCode, error: Exception) -> RefusedError:
        text = f"colours{made_by} for camera {self._camera!r} are refused: {error}"
        return self._refusals.refusal(text, code)

    def _use_file(self) -> None:
        """Use the file's ranges; raises CalibrationError and keeps the old."""
        colors = load_colors(self._path.parent, self._camera)
        check_nesting(colors)
        if colors != self._tracker.colors:
            step = self._tracker.prepare(colors, self._tracker.wanted(colors))
            self._tracker.use(colors, step)
            self._forget_problems()

    def _start_without(self, reason: str) -> None:
        """Use those of the wanted colours that there are, none if need be."""
        try:
            colors = load_colors(self._path.parent, self._camera)
        except CalibrationError:
            colors = Colors(colors={})
        names = self._tracker.calibrated(colors)
        self._tracker.use(colors, self._tracker.prepare(colors, names))
        self._report(f"{reason}. Until then {', '.join(names) or 'nothing'} is tracked")

    def _forget_problems(self) -> None:
        """Other ranges are used: what was said of the old ones no longer holds."""
        self._service.faults.clear("colors_missing", self._camera)
        self._service.faults.replace("color_drifted", {})
        self._refusals.clear()
        values = self._service.values
        for name in [name for name in values if name.endswith(("_hue_off", "_outside"))]:
            del values[name]

    def _report(self, text: str) -> None:
        """Say in health what is wrong, until other ranges are used."""
        self._service.faults.report("colors_missing", text, self._camera)


def _dated(colors: Colors) -> Colors:
    """With today's date, if they have none."""
    if colors.date:
        return colors
    now = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
    return msgspec.structs.replace(colors, date=now)


def _modified_ns(path: Path) -> int:
    """Time of the last change, 0 while there is no such file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
