"""Positions of a board that running cameras see: pictures asked for at the same time, and kept
where they add something.

A camera that does not answer, or a person who shows nothing new for two minutes, ends it with an
error; what was kept until then stays.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Mapping
from typing import Protocol

import cv2
import numpy as np

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.board.board_size import find_board_size
from services.calibrator.board.detect import Detection, detect
from services.calibrator.board.live_selection import LiveSelection, Verdict

# A lossless 5 Mpx PNG takes a Pi 3 about a second to encode, and a slow network another one.
_ANSWER_S = 5.0
# Without anything new for so long, nobody is there or the board cannot be seen.
_PATIENCE_S = 120.0
# Takes of a fast camera would otherwise saturate its Pi with encoding PNGs.
_PAUSE_S = 0.1


class Teller(Protocol):
    """Who tells a person what is going on."""

    def line(self, text: str) -> None:
        """News."""

    def status(self, text: str) -> None:
        """What is so until the next one."""


async def ask(bus: Bus, names: list[str]) -> dict[str, bytes]:
    """One picture of every camera that answers, asked for at the same time."""
    answers = await asyncio.gather(
        *(bus.get(topics.FRAME, timeout_s=_ANSWER_S, camera=name) for name in names)
    )
    return {name: answer[0] for name, answer in zip(names, answers, strict=True) if answer}


async def ask_all(bus: Bus, names: list[str]) -> dict[str, bytes]:
    """One picture of every camera; BusError if one does not answer."""
    pictures = await ask(bus, names)
    silent = [name for name in names if name not in pictures]
    if silent:
        raise BusError(
            f"camera {' and '.join(silent)} sends no picture; is its tracker running? "
            "`rhot top` shows it"
        )
    return pictures


def decoded(name: str, picture: bytes, mode: int) -> np.ndarray:
    """The picture of that camera; raises BusError for bytes that are none."""
    image = cv2.imdecode(np.frombuffer(picture, dtype=np.uint8), mode)
    if image is None:
        raise BusError(f"camera {name!r} answered {len(picture)} bytes that are no picture")
    return image


class BoardCollection:
    """One collecting of board positions, from the first picture to the last.

    Each position that is kept goes to `keep`, a PNG of each camera. board is the one that was
    counted, once it is; selection knows what is covered.
    """

    def __init__(
        self,
        names: list[str],
        square_m: float,
        count: int,
        teller: Teller,
        keep: Callable[[Mapping[str, bytes]], None],
        after_take: Callable[[Verdict | None], Awaitable[None]] | None = None,
    ) -> None:
        """after_take hears what became of each take, None before a board is found."""
        self.board: Board | None = None
        self.selection: LiveSelection | None = None
        self._names, self._teller, self._keep = names, teller, keep
        self._square_m, self._count = square_m, count
        self._after_take = after_take
        self._before: dict[str, bytes] = {}
        self._size: tuple[int, int] | None = None

    async def run(self, bus: Bus, board: Board | None) -> None:
        """Ask, compare, keep, until there are enough; raises CalibrationError if nothing comes."""
        news_s = time.monotonic()
        while self.selection is None or not self.selection.done:
            pictures = await ask_all(bus, self._names)
            # A slow camera answers twice with one picture, in which everything stands still.
            if not any(pictures[name] == self._before.get(name) for name in self._names):
                self._before = pictures
                verdict = await self._take(pictures, board)
                if verdict is Verdict.KEPT:
                    news_s = time.monotonic()
                if self._after_take is not None and not (self.selection and self.selection.done):
                    await self._after_take(verdict)
            if time.monotonic() - news_s > _PATIENCE_S:
                raise CalibrationError(self._given_up())
            await asyncio.sleep(_PAUSE_S)

    async def _take(self, pictures: dict[str, bytes], board: Board | None) -> Verdict | None:
        """What became of new pictures; None as long as no board was counted."""
        images = {
            name: await asyncio.to_thread(decoded, name, picture, cv2.IMREAD_GRAYSCALE)
            for name, picture in pictures.items()
        }
        if self.selection is None:
            board = board or await asyncio.to_thread(self._counted, images)
            if board is None:
                return None
            self.selection = LiveSelection(self._names, board, self._count)
        return await self._offer(self.selection, images, pictures)

    async def _offer(
        self, selection: LiveSelection, images: dict[str, np.ndarray], pictures: dict[str, bytes]
    ) -> Verdict:
        """What became of the position."""
        seen = {
            name: await asyncio.to_thread(_detected, image, selection.board)
            for name, image in images.items()
        }
        take = selection.offer(seen)
        if take.verdict is Verdict.KEPT:
            self.board = selection.board
            self._keep(pictures)
            self._teller.line(selection.text())
        self._teller.status(selection.text(take))
        return take.verdict

    def _counted(self, images: dict[str, np.ndarray]) -> Board | None:
        before, self._size = self._size, find_board_size(images.values())
        # A board that is just coming into the picture is counted too small: two takes must agree.
        if self._size is None or self._size != before:
            self._teller.status("looking for the board: show all of it, and hold it still")
            return None
        self._teller.line(f"a board of {self._size[0]}x{self._size[1]} inner corners")
        return Board(*self._size, self._square_m)

    def _given_up(self) -> str:
        state = self.selection.text() if self.selection else "no board was seen"
        return f"nothing new was shown for {_PATIENCE_S:.0f} s ({state})"


def _detected(image: np.ndarray, board: Board) -> Detection | None:
    return detect(image, board, quick=True)
