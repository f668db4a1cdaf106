"""What somebody explains (`rhot demo --tour`), as a note at the page's top left.

A caption that is not said again within seconds is over, and is taken away.
"""

from __future__ import annotations

import asyncio
import re

import viser

from rhot import topics
from rhot.bus.bus import Bus
from rhot.messages import Caption

# Captions are said once a second; on a busy machine one or two of them come late.
_OVER_S = 4.0
# A note is plain text: what a terminal marks as a command is quoted here.
_COMMAND = re.compile(r"`([^`]+)`")


class Captions:
    """The newest caption, in every browser that is connected."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._shown: dict[int, viser.NotificationHandle] = {}

    async def follow(self, bus: Bus) -> None:
        """Show captions as they come, for ever."""
        captions = bus.latest(topics.CAPTION)
        try:
            while True:
                try:
                    async with asyncio.timeout(_OVER_S if self._shown else None):
                        caption = await anext(captions)
                except TimeoutError:
                    self._take_away()
                else:
                    self._show(caption)
        finally:
            bus.close(captions)

    def _show(self, caption: Caption) -> None:
        number = f"{caption.step}/{caption.steps}  " if caption.steps else ""
        title, body = number + caption.title, _quoted(caption.text)
        clients = self._server.get_clients()
        self._shown = {one: note for one, note in self._shown.items() if one in clients}
        for one, client in clients.items():
            note = self._shown.get(one)
            if note is None:
                self._shown[one] = client.add_notification(title, body, with_close_button=False)
            elif (note.title, note.body) != (title, body):
                note.title, note.body = title, body

    def _take_away(self) -> None:
        for note in self._shown.values():
            note.remove()
        self._shown.clear()


def _quoted(text: str) -> str:
    return _COMMAND.sub("\u2018\\1\u2019", text)
