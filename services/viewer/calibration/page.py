"""The colours of the guided calibration, for one visitor: pictures from a camera's tracker, clicks
to it, fitted colour ranges back, which a button applies.

Pictures are requested only while a visitor looks at one, so cameras work no more than before. If a
tracker does not answer, the page says so and asks again; what it refuses is shown in its words.
"""

from __future__ import annotations

import asyncio
import datetime
import time
from collections import deque

import viser

from rhot import topics
from rhot.client import RigClient
from rhot.errors import RhotError
from rhot.messages.camera import FitRequest, FitResult, picture_name
from rhot.process.service import Service
from services.viewer.calibration import text
from services.viewer.calibration.gui import CalibrationControls, UserAction
from services.viewer.calibration.model import ColorCalibration
from services.viewer.calibration.picture import Image, annotated, decoded
from services.viewer.live.palette import paint_rgb

# Four pictures a second look live; encoding them losslessly takes a Pi 3 a fifth of its core.
_PICTURE_S = 0.25
# What moves is told by every so many-th of so many pictures: six of three seconds.
_EVERY, _RECENT = 2, 12
# A Pi 3 fits ranges to six pictures within five seconds.
_FIT_S = 15.0
# A browser needs this long to show a picture: a click that comes sooner belongs to the picture
# before.
_SHOWN_AFTER_S = 0.1


class ColourStep:
    """One visitor's calibration of colours; a task keeps it up to date while it is shown."""

    def __init__(self, service: Service, client: viser.ClientHandle) -> None:
        self._service = service
        self._client = RigClient(service.bus)
        self._actions: asyncio.Queue[UserAction] = asyncio.Queue()
        loop = asyncio.get_running_loop()
        self._controls = CalibrationControls(
            client,
            service.config,
            lambda action: loop.call_soon_threadsafe(self._actions.put_nowait, action),
        )
        self._calibration = ColorCalibration("", [])
        # Newest last: (name, picture, when it was sent to the browsers).
        self._pictures: list[tuple[str, Image, float]] = []
        self._recent: deque[str] = deque(maxlen=_RECENT)
        self._chosen = ""
        # Cameras whose colours were applied from here.
        self._done: set[str] = set()

        self._running: asyncio.Task[None] | None = None

    def show(self, visible: bool) -> None:
        """Begin with the colours, or leave them."""
        if visible == (self._running is not None):
            return
        if visible:
            self._controls.open()
            self._running = self._service.tasks.create_task(self._run())
        else:
            self.close()
            self._controls.close()

    def close(self) -> None:
        """Nobody looks any more."""
        if self._running is not None:
            self._running.cancel()
            self._running = None
        self._pictures.clear()
        self._recent.clear()

    async def _run(self) -> None:
        """Handle what the person does and fetch pictures, for ever."""
        await self._start()
        due_s = 0.0
        while True:
            action = await self._next_action(max(0.0, due_s - time.monotonic()))
            if action is not None:
                await self._handle(action)
            else:
                due_s = time.monotonic() + _PICTURE_S
                if not self._controls.held or not self._pictures:
                    await self._fetch_picture()
            self._update_texts()

    async def _next_action(self, timeout_s: float | None) -> UserAction | None:
        try:
            async with asyncio.timeout(timeout_s):
                return await self._actions.get()
        except TimeoutError:
            return None

    async def _handle(self, action: UserAction) -> None:
        match action.kind:
            case "camera":
                await self._start()
            case "color":
                self._chosen = self._controls.color
                self._show_chosen()
            case "click":
                await self._click(action.x, action.y)
            case "undo":
                self._calibration.undo()
                await self._fit(self._calibration.request() if self._calibration.clicks else None)
            case "reset":
                self._calibration.reset()
                self._show_chosen()
            case "auto":
                await self._propose()
            case "edit":
                self._calibration.edit(self._chosen, self._controls.span)
            case "apply":
                await self._apply()
        self._draw()

    async def _start(self) -> None:
        """Another camera, or the same one again: begin with the ranges applied there."""
        self._calibration = ColorCalibration(self._controls.camera, self._service.config.colors)
        self._pictures.clear()
        self._recent.clear()
        await self._ask_applied()
        self._chosen = self._calibration.names[0]
        self._show_chosen()

    async def _ask_applied(self) -> None:
        try:
            self._calibration.applied = await self._client.colors(self._calibration.camera)
        except RhotError as error:
            self._calibration.error = str(error)

    async def _fetch_picture(self) -> None:
        """Get one picture of the camera and show it."""
        answers = await self._service.bus.get(
            topics.FRAME, timeout_s=2.0, camera=self._calibration.camera
        )
        image = await asyncio.to_thread(decoded, answers[0]) if answers else None
        if image is None:
            return
        name = picture_name(answers[0])
        self._pictures = [*self._pictures[-1:], (name, image, time.monotonic())]
        self._recent.append(name)
        self._draw()

    def _draw(self) -> None:
        if not self._pictures:
            return
        name, image, _ = self._pictures[-1]
        ranges = self._calibration.ranges
        paints = {color: paint_rgb(color, []) for color in ranges}
        patches = [patch for patch in self._calibration.result.patches if patch.picture == name]
        self._controls.show(
            annotated(image, ranges, paints, self._chosen, patches, masks=self._controls.masks)
        )

    async def _click(self, x: float, y: float) -> None:
        if not self._pictures or not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
            return
        recent = time.monotonic() - self._pictures[-1][2] < _SHOWN_AFTER_S
        name, image, _ = self._pictures[0 if recent else -1]
        height, width = image.shape[:2]
        self._calibration.click(
            self._chosen, name, min(x * width, width - 1.0), min(y * height, height - 1.0)
        )
        if await self._fit(self._calibration.request()):
            self._chosen = self._calibration.next_to_click(self._chosen)
            self._show_chosen()

    async def _fit(self, request: FitRequest | None) -> bool:
        """Have ranges fitted to all clicks; returns whether the last one showed paint."""
        if request is None:
            self._show_chosen()
            return False
        good = self._calibration.take_fit(await self._ask_fit(request))
        self._show_chosen()
        return good

    async def _propose(self) -> None:
        """Have everything fitted that moved in the last seconds, or else stands out."""
        names = list(self._recent)[::-_EVERY][::-1]
        answer = await self._ask_fit(FitRequest(auto=True, pictures=names))
        if self._calibration.take_proposal(answer):
            self._chosen = self._calibration.next_to_click(self._chosen)
        self._show_chosen()

    async def _ask_fit(self, request: FitRequest) -> FitResult | None:
        """The tracker's answer, None if there is none in time."""
        answers = await self._service.bus.get(
            topics.FIT, timeout_s=_FIT_S, request=request, camera=self._calibration.camera
        )
        return answers[0] if answers else None

    async def _apply(self) -> None:
        now = datetime.datetime.now().astimezone()
        made = self._calibration.as_file(now.isoformat(timespec="milliseconds"))
        try:
            await self._client.set_colors(self._calibration.camera, made)
        except RhotError as error:
            self._calibration.error = str(error)
            return
        self._calibration.was_applied(made)
        self._done.add(self._calibration.camera)
        names = [camera.name for camera in self._service.config.camera]
        self._calibration.next_camera = next((n for n in names if n not in self._done), "")

    def _show_chosen(self) -> None:
        if self._chosen not in self._calibration.names:
            self._chosen = self._calibration.names[0]
        self._controls.set_color(
            self._calibration.names, self._chosen, self._calibration.range_of(self._chosen)
        )

    def _update_texts(self) -> None:
        calibration = self._calibration
        self._controls.set_texts(
            text.to_do(calibration, self._chosen, pictures=bool(self._pictures)),
            text.report(calibration),
            text.status(calibration),
            can_apply=calibration.changed,
        )
