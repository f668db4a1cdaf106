"""The calibration page without a browser: switches, clicks and answers, with a tracker that gives
three fixed answers.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import cv2
import msgspec
import numpy as np
from viser import _messages

from rhot import topics
from rhot.files.config import RigConfig
from rhot.messages.camera import ColorRange, Colors, FitRequest, FitResult, Patch, picture_name
from rhot.process.service import Service
from services.viewer.calibration.placing import placed
from services.viewer.service import serve
from testing.waiting import until

GREEN = ColorRange(hsv_low=(50, 100, 40), hsv_high=(70, 255, 255))


class Tracker:
    """Answers as a tracker does."""

    def __init__(self, bus: Any) -> None:
        self.pictures_asked = 0
        self.requests: list[FitRequest] = []
        self.colors = Colors(colors={"violet": GREEN})
        self.refuses = ""
        self.bus = bus
        image = np.full((48, 64, 3), 128, np.uint8)
        self.png = cv2.imencode(".png", image)[1].tobytes()
        bus.answer(topics.FRAME, self._picture, camera="left")
        bus.answer_requests(topics.COLORS, self._colors, camera="left")
        bus.answer_requests(topics.FIT, self._fit, camera="left")

    def _picture(self) -> bytes:
        self.pictures_asked += 1
        return self.png

    async def _fit(self, payload: bytes) -> FitResult:
        self.requests.append(msgspec.json.decode(payload, type=FitRequest))
        if self.refuses:
            return FitResult(error=self.refuses)
        patch = Patch(color="blue", picture=picture_name(self.png), box_px=(10, 10, 8, 8))
        return FitResult(colors={"blue": GREEN}, patches=[patch], warnings=["<b>mind</b> the lamp"])

    async def _colors(self, payload: bytes) -> Colors:
        if payload:
            self.colors = msgspec.json.decode(payload, type=Colors)
        return self.colors


class Page:
    """A browser that knows the page's controls by their labels."""

    def __init__(self, browser: Any) -> None:
        self.browser = browser

    async def uuid(self, type_: str, label: str) -> str:
        message = await asyncio.to_thread(
            self.browser.wait_for, type_, props=lambda props: props.get("label") == label
        )
        return str(message["uuid"])

    async def says(self, words: str) -> str:
        message = await asyncio.to_thread(
            self.browser.wait_for,
            "GuiUpdateMessage",
            updates=lambda u: words in u.get("content", ""),
        )
        return str(message["updates"]["content"])

    async def shows_picture(self) -> None:
        await asyncio.to_thread(
            self.browser.wait_for, "BackgroundImageMessage", rgb_data=lambda data: data is not None
        )

    def click_picture(self, x: float, y: float) -> None:
        """x, y from 0 to 1, of a 4:3 picture in a window of the size that browsers begin with."""
        _, place = placed(np.zeros((48, 64, 3), np.uint8), (100, 100))
        at = (place.left + x * place.width, place.top + y * place.height)
        self.browser._send(
            _messages.ScenePointerMessage("click", (0, 0, 0), (0, 0, 1), (at,), None)
        )


async def open_page(service: Service, browse: Callable[..., Any]) -> Page:
    page = Page(await asyncio.to_thread(browse, int(service.values["port"])))
    choice = await page.uuid("GuiDropdownMessage", "step")
    page.browser._send(_messages.GuiUpdateMessage(choice, {"value": "Colours"}))
    return page


async def test_a_click_is_fitted_shown_and_applied(
    running: Callable, config: RigConfig, browse: Callable
) -> None:
    async with running("viewer", serve, config) as (service, bus):
        tracker = Tracker(bus)
        await until(lambda: service.state == "running")
        assert tracker.pictures_asked == 0
        page = await open_page(service, browse)
        await page.shows_picture()
        await page.says("click the middle of the blue marker")
        page.click_picture(0.25, 0.5)
        report = await page.says("mind")
        assert "&lt;b&gt;mind" in report
        (pointed,) = tracker.requests[0].pointed
        assert (pointed.color, pointed.x_px, pointed.y_px) == ("blue", 16.0, 24.0)
        assert pointed.picture == picture_name(tracker.png)
        await page.says("not applied yet")
        page.browser._send(
            _messages.GuiUpdateMessage(
                await page.uuid("GuiButtonMessage", "apply"), {"value": True}
            )
        )
        await page.says("applied on camera left")
        assert tracker.colors.colors == {"violet": GREEN, "blue": GREEN}
        assert tracker.colors.tool == "rhot-viewer"
        assert tracker.colors.date


async def test_what_the_tracker_says_of_a_bad_click_is_shown_and_forgotten(
    running: Callable, config: RigConfig, browse: Callable
) -> None:
    async with running("viewer", serve, config) as (service, bus):
        tracker = Tracker(bus)
        tracker.refuses = "that is <grey>"
        await until(lambda: service.state == "running")
        page = await open_page(service, browse)
        await page.shows_picture()
        page.click_picture(0.5, 0.5)
        assert "that is &lt;grey&gt;" in await page.says("that is")
        await page.says("0 of 2 colours clicked")
        # Beside the picture is nowhere.
        page.click_picture(1.5, 0.5)
        tracker.refuses = ""
        page.click_picture(0.5, 0.5)
        await page.says("1 of 2 colours clicked")
        assert [len(request.pointed) for request in tracker.requests] == [1, 1]


async def test_pictures_are_asked_for_only_while_the_page_shows_one(
    running: Callable, config: RigConfig, browse: Callable
) -> None:
    async with running("viewer", serve, config) as (service, bus):
        tracker = Tracker(bus)
        await until(lambda: service.state == "running")
        page = await open_page(service, browse)
        await until(lambda: tracker.pictures_asked >= 2)
        page.browser.close()
        await until(lambda: not service.bus._tasks._running)
        count = tracker.pictures_asked
        await asyncio.sleep(0.8)
        assert tracker.pictures_asked <= count + 1


async def test_no_tracker_is_said_to_be_missing(
    running: Callable, config: RigConfig, browse: Callable
) -> None:
    async with running("viewer", serve, config) as (service, _):
        await until(lambda: service.state == "running")
        page = await open_page(service, browse)
        await page.says("waiting for a picture of camera left")
