"""What the calibrator does, for all visitors of a page; asked for only while somebody looks."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from rhot import topics
from rhot.errors import RhotError
from rhot.messages.calibration import CalibrationOrder, CalibrationState
from rhot.process.service import Service

# The page follows a person's exercises: four seconds each.
_PERIOD_S = 0.3
# One that has not answered for so long is not there, or starts anew.
_SILENT_S = 4.0
# While a step is in one of these it goes on.
WORKING = ("collecting", "computing")


class CalibratorLink:
    """The newest state; None while no calibrator answers.

    lost: it was started again while it measured something, of which it knows nothing any more.
    """

    def __init__(self, service: Service) -> None:
        self._service = service
        self.state: CalibrationState | None = None
        self.lost = False
        self._known = CalibrationState()
        self._watchers = 0
        self._task: asyncio.Task[None] | None = None

    def watch(self) -> None:
        """Somebody looks."""
        self._watchers += 1
        if self._task is None:
            self._task = self._service.tasks.create_task(self._follow())

    def leave(self) -> None:
        """Somebody looks no more."""
        self._watchers -= 1
        if not self._watchers and self._task is not None:
            self._task.cancel()
            self._task = None

    def send(self, order: CalibrationOrder, refused: Callable[[str], None]) -> None:
        """Ask for something; what comes of it is in the state, or refused hears why it is not."""
        self._service.tasks.create_task(self._send(order, refused))

    async def _send(self, order: CalibrationOrder, refused: Callable[[str], None]) -> None:
        try:
            self.heard(await self._service.bus.request(topics.CALIBRATE, order, timeout_s=20.0))
        except RhotError as error:
            refused(str(error))

    def heard(self, state: CalibrationState) -> None:
        """The calibrator's newest state."""
        before, self._known, self.state = self._known, state, state
        if state.phase in WORKING:
            self.lost = False
        elif before.phase in WORKING and state.number < before.number:
            self.lost = True

    async def _follow(self) -> None:
        loop = asyncio.get_running_loop()
        heard_s = loop.time()
        while True:
            answers = await self._service.bus.get(topics.CALIBRATE, timeout_s=_SILENT_S)
            if answers:
                self.heard(answers[0])
                heard_s = loop.time()
            elif loop.time() - heard_s > _SILENT_S:
                self.state = None
            await asyncio.sleep(_PERIOD_S)
