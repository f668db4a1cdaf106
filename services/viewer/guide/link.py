"""What the calibrator does, for all visitors of a page; asked for only while somebody looks."""

from __future__ import annotations

import asyncio

from rhot import topics
from rhot.errors import RhotError
from rhot.messages.calibration import CalibrationOrder, CalibrationState
from rhot.process.service import Service

# The page follows a person's exercises: four seconds each.
_PERIOD_S = 0.3
# One that has not answered for so long is not there, or starts anew.
_SILENT_S = 4.0


class CalibratorLink:
    """The newest state; None while no calibrator answers. error is why an order was refused."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self.state: CalibrationState | None = None
        self.error = ""
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

    def send(self, order: CalibrationOrder) -> None:
        """Ask for something; what comes of it is in the state, or in error."""
        self._service.tasks.create_task(self._send(order))

    async def _send(self, order: CalibrationOrder) -> None:
        try:
            self.state = await self._service.bus.request(topics.CALIBRATE, order, timeout_s=20.0)
            self.error = ""
        except RhotError as error:
            self.error = str(error)

    async def _follow(self) -> None:
        loop = asyncio.get_running_loop()
        heard_s = loop.time()
        while True:
            answers = await self._service.bus.get(topics.CALIBRATE, timeout_s=_SILENT_S)
            if answers:
                self.state, heard_s = answers[0], loop.time()
            elif loop.time() - heard_s > _SILENT_S:
                self.state = None
            await asyncio.sleep(_PERIOD_S)
