"""Calibrating colours in the page: pictures from the camera's tracker, clicks to it, ranges back,
and into force.

Pictures are asked for only while the page shows one, so cameras work no more than before. A tracker
that does not answer is said to be missing, and asked again; what it refuses is shown in its words.
"""

from __future__ import annotations

import asyncio
import datetime
import time

import viser

from rhot import topics
from rhot.camera_messages import FitRequest, picture_name
from rhot.client import RigClient
from rhot.errors import RhotError
from rhot.process.service import Service
from services.viewer.calibration import text
from services.viewer.calibration.gui import Action, CalibrateGui
from services.viewer.calibration.model import Session
from services.viewer.calibration.picture import Image, decoded, shown
from services.viewer.live.palette import paint_rgb

# Four pictures a second look alive; encoding them losslessly takes a Pi 3 a fifth of its core.
_PICTURE_S = 0.25
# A Pi 3 fits ranges to six pictures within five seconds.
_FIT_S = 15.0
# A click belongs to the picture before if the newest was sent less than this ago: a browser needs
# so long to show one.
_SHOWN_AFTER_S = 0.1


class Calibrate:
    """The page's calibration; run() is its life."""

    def __init__(self, service: Service, server: viser.ViserServer) -> None:
        self._service, self._server = service, server
        self._client = RigClient(service.bus)
        self._actions: asyncio.Queue[Action] = asyncio.Queue()
        loop = asyncio.get_running_loop()
        self._gui = CalibrateGui(
            server,
            service.config,
            lambda action: loop.call_soon_threadsafe(self._actions.put_nowait, action),
        )
        self._session = Session("", [])
        # Newest last: (name, picture, when it was sent to the browsers).
        self._pictures: list[tuple[str, Image, float]] = []
        self._chosen = ""
        # Cameras whose colours were put in force from here.
        self._done: set[str] = set()

    async def run(self) -> None:
        """For ever."""
        due_s = 0.0
        while True:
            action = await self._next(
                max(0.0, due_s - time.monotonic()) if self._gui.is_open else None
            )
            if action is not None:
                await self._do(action)
            elif not self._server.get_clients():
                self._gui.close()
                self._end()
            else:
                due_s = time.monotonic() + _PICTURE_S
                if not self._gui.held or not self._pictures:
                    await self._look()
            self._say()

    async def _next(self, patience_s: float | None) -> Action | None:
        try:
            async with asyncio.timeout(patience_s):
                return await self._actions.get()
        except TimeoutError:
            return None

    async def _do(self, action: Action) -> None:
        match action.kind:
            case "open" | "camera":
                await self._begin()
            case "close":
                self._end()
            case "color":
                self._chosen = self._gui.color
                self._show_chosen()
            case "click":
                await self._click(action.x, action.y)
            case "undo":
                self._session.undo()
                await self._fit(self._session.request() if self._session.pointed else None)
            case "reset":
                self._session.reset()
                self._show_chosen()
            case "auto":
                await self._propose()
            case "edit":
                self._session.edit(self._chosen, self._gui.span)
            case "save":
                await self._save()
        self._draw()

    async def _begin(self) -> None:
        """Another camera, or the same one again: from what is in force there."""
        if not self._gui.is_open:
            return
        self._session = Session(self._gui.camera, self._service.config.colors)
        self._pictures.clear()
        await self._ask_in_force()
        self._chosen = self._session.names[0]
        self._show_chosen()

    async def _ask_in_force(self) -> None:
        try:
            self._session.in_force = await self._client.colors(self._session.camera)
        except RhotError as error:
            self._session.error = str(error)

    def _end(self) -> None:
        self._pictures.clear()
        self._gui.hide()

    async def _look(self) -> None:
        """One picture of the camera, to the browsers."""
        answers = await self._service.bus.get(
            topics.FRAME, timeout_s=2.0, camera=self._session.camera
        )
        image = await asyncio.to_thread(decoded, answers[0]) if answers else None
        if image is None or not self._gui.is_open:
            return
        self._pictures = [*self._pictures[-1:], (picture_name(answers[0]), image, time.monotonic())]
        self._draw()

    def _draw(self) -> None:
        if not self._pictures or not self._gui.is_open:
            return
        name, image, _ = self._pictures[-1]
        ranges = self._session.ranges
        paints = {color: paint_rgb(color, []) for color in ranges}
        patches = [patch for patch in self._session.result.patches if patch.picture == name]
        self._gui.show(shown(image, ranges, paints, self._chosen, patches, masks=self._gui.masks))

    async def _click(self, x: float, y: float) -> None:
        if not self._pictures or not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
            return
        recent = time.monotonic() - self._pictures[-1][2] < _SHOWN_AFTER_S
        name, image, _ = self._pictures[0 if recent else -1]
        height, width = image.shape[:2]
        self._session.point(
            self._chosen, name, min(x * width, width - 1.0), min(y * height, height - 1.0)
        )
        if await self._fit(self._session.request()):
            self._chosen = self._session.next_after(self._chosen)
            self._show_chosen()

    async def _fit(self, request: FitRequest | None) -> bool:
        """Have ranges fitted to all that was pointed at; whether that went well."""
        if request is None:
            self._show_chosen()
            return False
        answers = await self._service.bus.get(
            topics.FIT, timeout_s=_FIT_S, request=request, camera=self._session.camera
        )
        good = self._session.take(answers[0] if answers else None)
        self._show_chosen()
        return good

    async def _propose(self) -> None:
        names = [name for name, _, _ in self._pictures]
        request = FitRequest(auto=True, pictures=names)
        answers = await self._service.bus.get(
            topics.FIT, timeout_s=_FIT_S, request=request, camera=self._session.camera
        )
        self._session.take_proposal(answers[0] if answers else None)
        self._show_chosen()

    async def _save(self) -> None:
        made = self._session.file(
            datetime.datetime.now().astimezone().isoformat(timespec="milliseconds")
        )
        try:
            await self._client.set_colors(self._session.camera, made)
        except RhotError as error:
            self._session.error = str(error)
        else:
            self._session.was_saved(made)
            self._done.add(self._session.camera)
            others = [
                camera.name
                for camera in self._service.config.camera
                if camera.name not in self._done
            ]
            self._session.next_camera = others[0] if others else ""

    def _show_chosen(self) -> None:
        if self._chosen not in self._session.names:
            self._chosen = self._session.names[0]
        self._gui.choose(self._session.names, self._chosen, self._session.range_of(self._chosen))

    def _say(self) -> None:
        if not self._gui.is_open:
            self._gui.say("", "", "", savable=False)
            return
        session = self._session
        to_do = text.to_do(session, self._chosen, pictures=bool(self._pictures))
        self._gui.say(to_do, text.report(session), text.verdict(session), savable=session.changed)
