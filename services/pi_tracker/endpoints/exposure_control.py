"""The camera's exposure over the bus: asked for, set, found by the camera's automatics if wished.

What holds is written to its file. A source without such controls (a file, the simulator) says so
and refuses; automatics that do not settle in time are frozen at the last values, with a note; a
driver that reports nothing is a refusal. What is refused leaves the old values: who asked by a
query gets a typed Refusal, who put finds the reason in health.
"""

from __future__ import annotations

import asyncio
import datetime
import time

import msgspec

from rhot import clock, topics
from rhot.errors import UNDECODABLE, CalibrationError, RefusalCode, RefusedError
from rhot.files.calibration import Exposure, load_exposure
from rhot.messages.camera import ExposureControl
from rhot.process.service import Service
from services.pi_tracker.colors.settling import Settling
from services.pi_tracker.endpoints.latest_change import LatestChange, write_setting
from services.pi_tracker.endpoints.refusals import Refusals
from services.pi_tracker.sources.controls import Controls

# picamera2's automatics settle in one to two seconds, a webcam's in five.
_SETTLE_TIMEOUT_S = 15.0
# Twice a frame at 30 fps: every report is seen.
_POLL_S = 0.015


class ExposureEndpoint:
    """Exposure of one camera; attach() it once the source is open."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._camera = service.config.camera_named(service.instance)
        self._path = service.config.calibration_dir / f"{self._camera.name}.exposure.json"
        self._controls: Controls | None = None
        self._state = ExposureControl(adjustable=False, note="the camera is not open yet")
        # One change at a time: automatics run for seconds.
        self._changes = LatestChange(self._set, _merged)
        self._refusals = Refusals(service, "exposure")
        service.bus.answer_requests(topics.EXPOSURE, self._answer, camera=self._camera.name)

    def attach(self, controls: Controls | None) -> None:
        """The source's controls, None if it has none."""
        self._controls = controls
        if controls is None:
            note = f"source {self._camera.source.partition(':')[0]!r} has no exposure to set"
            self._state = ExposureControl(adjustable=False, note=note)
            return
        try:
            self._state = _state(
                load_exposure(self._path.parent, self._camera.name), controls.note, 0
            )
        except CalibrationError:
            note = (
                "not calibrated: the camera's automatics run all the time, "
                "and colours drift with them"
            )
            self._state = ExposureControl(mode="auto", note=note)

    async def follow(self) -> None:
        """Do what is put on the bus, for ever. A put has no reply: refusals go to health."""
        async for sample in self._service.bus.raw(topics.EXPOSURE, 4, camera=self._camera.name):
            try:
                await self._change(sample.payload)
            except RefusedError as error:
                self._refusals.tell(error)

    async def _answer(self, payload: bytes) -> ExposureControl:
        """The exposure, after the change that the payload asks for."""
        if payload:
            await self._change(payload)
        return self._state

    async def _change(self, payload: bytes) -> None:
        try:
            wanted = msgspec.json.decode(payload, type=ExposureControl)
            await self._changes.make(wanted)
        except RefusedError as error:
            raise self._refusal(error.code, error) from None
        except UNDECODABLE as error:
            raise self._refusal("malformed", error) from None

    def _refusal(self, code: RefusalCode, error: Exception) -> RefusedError:
        text = f"exposure for camera {self._camera.name!r} is refused: {error}"
        return self._refusals.refusal(text, code)

    async def _set(self, wanted: ExposureControl) -> None:
        if self._controls is None:
            raise RefusedError(self._state.note, "unsupported")
        if wanted.mode == "auto":
            await self._settle(self._controls)
            return
        exposure = Exposure(
            exposure_us=wanted.exposure_us or self._state.exposure_us or _unknown("exposure_us"),
            gain=wanted.gain or self._state.gain,
            red_gain=wanted.red_gain or self._state.red_gain,
            blue_gain=wanted.blue_gain or self._state.blue_gain,
        )
        if min(exposure.gain, exposure.red_gain, exposure.blue_gain) <= 0.0:
            _unknown("gain, red_gain and blue_gain")
        await self._fix(exposure, self._controls, "by hand", self._controls.note)

    async def _settle(self, controls: Controls) -> None:
        """Run the automatics, freeze what they find."""
        before = self._state
        self._state = ExposureControl(mode="auto", note="the automatics are running")
        controls.adjust(None)
        settling, last = Settling(), None
        deadline_s = time.monotonic() + _SETTLE_TIMEOUT_S
        while (found := settling.settled()) is None and time.monotonic() < deadline_s:
            await asyncio.sleep(_POLL_S)
            report = controls.reported
            if report is not None and report is not last:
                settling.add(report, time.monotonic_ns())
                last = report
        if found is None and last is None:
            self._state = before
            if before.exposure_us > 0.0 and before.mode == "fixed":
                controls.adjust(_exposure(before))
            raise RefusedError(
                f"the driver reports no exposure within {_SETTLE_TIMEOUT_S:.0f} s; "
                "set the values by hand",
                "unsupported",
            )
        note = (
            controls.note
            if found
            else f"the automatics had not settled after {_SETTLE_TIMEOUT_S:.0f} s: "
            "is the picture still?"
        )
        await self._fix(found or last or _exposure(before), controls, "automatics, once", note)

    async def _fix(self, exposure: Exposure, controls: Controls, how: str, note: str) -> None:
        date = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
        made = msgspec.structs.replace(
            exposure, date=date, tool="rhot calibrate camera", inputs={"how": how, "note": note}
        )
        controls.adjust(made)
        try:
            await asyncio.to_thread(write_setting, self._path, made)
        except OSError as error:
            self._state = _state(made, note, 0)
            raise RefusedError(
                f"{self._path} cannot be written: {error}; the values hold until the tracker ends",
                "not_saved",
            ) from None
        self._state = _state(made, note, clock.now_ns())
        self._refusals.clear()


def _merged(earlier: ExposureControl, later: ExposureControl) -> ExposureControl:
    """Both wishes in one, as if made one after the other; a 0 leaves a value as it is."""
    if "auto" in (earlier.mode, later.mode):
        return later
    return msgspec.structs.replace(
        later,
        exposure_us=later.exposure_us or earlier.exposure_us,
        gain=later.gain or earlier.gain,
        red_gain=later.red_gain or earlier.red_gain,
        blue_gain=later.blue_gain or earlier.blue_gain,
    )


def _unknown(what: str) -> float:
    raise RefusedError(
        f"{what} must be given once: nobody knows the camera's own; or run the automatics once"
    )


def _state(exposure: Exposure, note: str, changed_ns: int) -> ExposureControl:
    return ExposureControl(
        exposure_us=min(exposure.exposure_us, 1e6),
        gain=min(exposure.gain, 64.0),
        red_gain=min(exposure.red_gain, 64.0),
        blue_gain=min(exposure.blue_gain, 64.0),
        note=note,
        changed_ns=changed_ns,
    )


def _exposure(state: ExposureControl) -> Exposure:
    return Exposure(
        exposure_us=state.exposure_us,
        gain=state.gain,
        red_gain=state.red_gain,
        blue_gain=state.blue_gain,
    )
