"""The first step: each camera measures the light once, and keeps its exposure; for one visitor."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import viser

from rhot.client import RigClient
from rhot.errors import RhotError
from rhot.messages.camera import ExposureControl
from rhot.process.service import Service
from services.viewer.guide import texts
from services.viewer.guide.callbacks import on_loop
from services.viewer.visits.section import Seen

# Exposure changes when somebody sets it: here or elsewhere.
_PERIOD_S = 2.0


class ExposureStep:
    """A button for each camera, what it has now, and what is wrong with its pictures."""

    def __init__(self, service: Service, client: viser.ClientHandle) -> None:
        self._client, self._tasks = RigClient(service.bus), service.tasks
        names = [camera.name for camera in service.config.camera]
        self._buttons = {
            name: client.gui.add_button(f"Measure the light: {name}", visible=False)
            for name in names
        }
        self._texts = {name: client.gui.add_html("", visible=False) for name in names}
        self._states: dict[str, ExposureControl | None] = dict.fromkeys(names)
        self._errors = dict.fromkeys(names, "")
        self._refused = dict.fromkeys(names, "")
        self._following: asyncio.Task[None] | None = None
        for name, button in self._buttons.items():
            button.on_click(on_loop(self._measuring(name)))

    def _measuring(self, name: str) -> Callable[[Any], None]:
        return lambda _: self._measure(name)

    def show(self, visible: bool) -> None:
        """Show or hide; cameras are asked only while it is shown."""
        for name, button in self._buttons.items():
            button.visible = self._texts[name].visible = visible
        if visible and self._following is None:
            self._following = self._tasks.create_task(self._follow())
        if not visible:
            self.close()

    def update(self, seen: Seen) -> None:
        """Bring the texts up to date."""
        for name, handle in self._texts.items():
            state = self._states[name]
            error = self._refused[name] or self._errors[name]
            content = texts.exposure(name, state, error, seen.faults)
            if handle.content != content:
                handle.content = content
            self._buttons[name].disabled = state is None or not state.adjustable

    def close(self) -> None:
        """Nobody looks."""
        if self._following is not None:
            self._following.cancel()
            self._following = None

    async def _follow(self) -> None:
        while True:
            for name in self._states:
                try:
                    self._states[name] = await self._client.exposure(name)
                    self._errors[name] = ""
                except RhotError as error:
                    self._states[name], self._errors[name] = None, str(error)
            await asyncio.sleep(_PERIOD_S)

    def _measure(self, name: str) -> None:
        self._buttons[name].disabled, self._refused[name] = True, ""
        self._tasks.create_task(self._set(name))

    async def _set(self, name: str) -> None:
        try:
            self._states[name] = await self._client.set_exposure(name, ExposureControl(mode="auto"))
        except RhotError as error:
            self._refused[name] = str(error)
