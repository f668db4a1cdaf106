"""Tells what is happening: on the terminal, and as captions that the page shows."""

from __future__ import annotations

import asyncio
import textwrap
from collections.abc import Callable

from rhot import topics
from rhot.bus.bus import Bus
from rhot.messages import Caption
from services.cli.terminal import Terminal

# Captions are said again this often: a page that opens late shows them, one whose tour was killed
# takes them away (services/viewer/guide/captions.py).
AGAIN_S = 1.0
_POLL_S = 0.05
_WIDTH = 92
# Silent reading of plain English: 238 words a minute (Brysbaert 2019); some look at the hand first.
_WORDS_PER_S, _LOOK_S = 4.0, 1.5


class Narrator:
    """Says one thing at a time. pace 0.1 waits a tenth of the time that reading takes."""

    def __init__(self, bus: Bus, terminal: Terminal, steps: int, pace: float = 1.0) -> None:
        self._publisher = bus.publisher(topics.CAPTION)
        self._terminal, self._steps, self._pace = terminal, steps, pace
        self._caption: Caption | None = None
        self._title, self._step = "", 0

    async def repeat(self) -> None:
        """Say the newest caption again and again, for ever."""
        while True:
            if self._caption is not None:
                self._publisher.put(self._caption)
            await asyncio.sleep(AGAIN_S)

    def title(self, text: str) -> None:
        """Begin a step."""
        self._step += 1
        self._title = text
        self._terminal.line(f"\n{self._step}/{self._steps}  {text}")

    async def say(self, text: str, least_s: float = 0.0) -> None:
        """Show a sentence or two for as long as reading takes, and least_s at least."""
        self._caption = Caption(title=self._title, text=text, step=self._step, steps=self._steps)
        self._publisher.put(self._caption)
        self._terminal.line(textwrap.indent(textwrap.fill(text, _WIDTH), "     "))
        reading_s = _LOOK_S + len(text.split()) / _WORDS_PER_S
        await asyncio.sleep(self._pace * max(reading_s, least_s))

    def begin(self) -> None:
        """Count the steps from the first one again."""
        self._step = 0


async def until(condition: Callable[[], object], seconds: float) -> float | None:
    """How long it took until the condition held, s; None if it did not within `seconds`."""
    began_s = asyncio.get_running_loop().time()
    while not condition():
        if asyncio.get_running_loop().time() - began_s > seconds:
            return None
        await asyncio.sleep(_POLL_S)
    return asyncio.get_running_loop().time() - began_s
