"""One step of a calibration at a time: started, told about, stopped and saved by requests."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

import msgspec

from rhot.bus.bus import Bus
from rhot.errors import CalibrationError, RefusedError, RhotError
from rhot.files.calibration import save
from rhot.files.config import RigConfig
from rhot.messages.calibration import CalibrationOrder, CalibrationState
from services.calibrator.endpoints.desk import Desk
from services.calibrator.guided.found import Found

log = logging.getLogger("rhot.calibrator")

_WORKING = ("collecting", "computing")
# systemd and `rhot up` give a service five seconds to end.
_CLOSING_S = 2.0


class Guide:
    """What is calibrated now, for everybody who asks."""

    def __init__(self, bus: Bus, config: RigConfig) -> None:
        self._bus, self._config = bus, config
        self._state = CalibrationState()
        self._found: Found | None = None
        self._task: asyncio.Task[None] | None = None

    async def answer(self, payload: bytes) -> CalibrationState:
        """The state, after what a request asks for; raises RefusedError with the reason."""
        if payload:
            order = msgspec.json.decode(payload, type=CalibrationOrder)
            match order.action:
                case "start":
                    self._start(order)
                case "stop":
                    await self._stop()
                case "save":
                    await self._save()
        return self._state

    async def close(self) -> None:
        """End what is going on; a simulated rig shows its own scene again."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait({self._task}, timeout=_CLOSING_S)

    def _start(self, order: CalibrationOrder) -> None:
        if self._state.phase in _WORKING:
            raise RefusedError("a calibration is going on already: stop it first", "busy")
        self._found = None
        number = self._state.number + 1
        self._state = CalibrationState(phase="collecting", number=number, order=order)
        self._task = asyncio.create_task(self._run(order))

    async def _stop(self) -> None:
        await self._end()
        self._found = None
        self._state = CalibrationState(number=self._state.number)

    async def _end(self) -> None:
        """End the step that goes on; what it has found stays."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait({task})

    async def _save(self) -> None:
        found = self._found
        if found is None or self._state.phase not in ("collecting", "done", "saved"):
            raise RefusedError("there is nothing to save: finish a step first")
        if found.only_good and not found.good:
            raise RefusedError(f"not saved, since it is not good yet. {' '.join(found.advice)}")
        if self._state.phase == "collecting":
            await self._end()
            self._finished()
        folder = self._config.calibration_dir
        for name, made in found.files.items():
            await asyncio.to_thread(save, folder / name, made)
        self._change(phase="saved", files=list(found.files))

    async def _run(self, order: CalibrationOrder) -> None:
        try:
            found = await _job(Desk(self._bus, self._config, order, self._change, self._offer))
        except RhotError as error:
            self._change(phase="failed", to_do=str(error)[:1000])
        except Exception as error:
            log.exception("calibration of %s", order.step)
            self._change(phase="failed", to_do=f"this should not happen: {error!r}"[:1000])
        else:
            self._offer(found)
            self._finished()

    def _finished(self) -> None:
        self._change(phase="done", progress=1.0, to_do="", seen=[])

    def _offer(self, found: Found) -> None:
        """What can be saved from now on."""
        self._found = found
        self._change(
            good=found.good,
            figures=found.figures,
            advice=[text[:1000] for text in found.advice[:32]],
        )

    def _change(self, **fields: object) -> None:
        self._state = msgspec.structs.replace(self._state, **fields)


async def _job(desk: Desk) -> Found:
    """The step that is wanted. OpenCV and scipy are loaded with the first one: beside the loop, as
    a busy machine takes seconds for them, and who asks meanwhile is to be answered.
    """
    step = await asyncio.to_thread(_step_of, desk.order)
    return await step(desk)


def _step_of(order: CalibrationOrder) -> Callable[[Desk], Awaitable[Found]]:
    match order.step:
        case "hand":
            from services.calibrator.endpoints.hand_step import hand_step
            from services.calibrator.endpoints.hand_use_step import hand_use_step

            return hand_use_step if order.way == "use" else hand_step
        case "lens" | "stereo":
            from services.calibrator.endpoints.board_step import board_step

            return board_step
        case "objects":
            from services.calibrator.endpoints.objects_step import objects_step

            return objects_step
    raise CalibrationError(f"there is no step {order.step!r}")
