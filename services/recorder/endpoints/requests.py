"""What the recorder answers on the bus: what it does, its files, and requests to record or replay.

Requests that cannot be granted are refused with the reason, and change nothing.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Protocol

import msgspec

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import RefusedError
from rhot.messages.recording import RecorderRequest, RecorderState, Recordings
from services.recorder.endpoints.deck import Deck
from services.recorder.endpoints.library import Library


class Tape(Protocol):
    """What records."""

    def record(self) -> None:
        """Begin a recording; raises RhotError."""

    def stop(self) -> None:
        """End the recording; raises RhotError."""

    def state(self) -> RecorderState:
        """What is recorded; without the replay."""


class Requests:
    """Answers for a folder of recordings, or for one that is open; tape None: nothing records."""

    def __init__(self, deck: Deck, library: Library | None, tape: Tape | None) -> None:
        self._deck, self._library, self._tape = deck, library, tape
        # One request after the other: opening a file takes a while.
        self._one = asyncio.Lock()

    def answer_on(self, bus: Bus) -> None:
        """Answer from now on."""
        bus.answer_requests(topics.RECORDER, self.answer)
        bus.answer(topics.RECORDINGS, self.recordings)

    async def recordings(self) -> Recordings:
        """The files there are."""
        if self._library is None:
            return Recordings(folder="", recordings=[])
        return await asyncio.to_thread(self._library.list)

    async def answer(self, payload: bytes) -> RecorderState:
        """Do what is asked for; what holds then."""
        if payload:
            request = msgspec.json.decode(payload, type=RecorderRequest)
            async with self._one:
                await self._do(request)
        state = RecorderState(records=False) if self._tape is None else self._tape.state()
        return msgspec.structs.replace(state, replay=self._deck.state(), note=self._deck.note)

    async def _do(self, request: RecorderRequest) -> None:
        if request.do in ("record", "stop"):
            if self._tape is None:
                raise RefusedError("nothing records here: this is a replay", "unsupported")
            if request.do == "record":
                self._tape.record()
            else:
                self._tape.stop()
        elif request.do == "open":
            await self._deck.open(
                await asyncio.to_thread(self._path, request.name),
                rate=request.rate or 1.0,
                loop=bool(request.loop),
            )
        else:
            await self._deck.control(request)

    def _path(self, name: str | None) -> Path:
        if self._library is None:
            raise RefusedError("only the recording that is open can be replayed", "unsupported")
        if name is None:
            raise RefusedError('"open" needs the name of a recording', "invalid")
        return self._library.path(name)
