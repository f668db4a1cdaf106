"""Pictures from the running cameras: the next ones of one camera, one of each, or positions of a
board, asked for at the same time, kept when they add something, written as PNG.

A camera that does not answer, or a person who shows nothing new for two minutes, ends it with an
error; Ctrl-C ends the collecting, and what was collected is used.
"""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import uvloop

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, CalibrationError
from rhot.files.config import RigConfig
from services.cli.router_session import endpoints_of, router_session
from services.cli.terminal import Terminal
from services.pi_tracker.image.frame import Frame

if TYPE_CHECKING:
    from services.calibrator.board.board import Board
    from services.calibrator.board.detect import Detection
    from services.calibrator.board.live_selection import LiveSelection

# A lossless 5 Mpx PNG takes a Pi 3 about a second to encode, and a slow network another one.
_ANSWER_S = 5.0
# Asked again this often, a fifth of a second later, then two: a router knows of a tracker that has
# just come up by then.
_ATTEMPTS, _RETRY_S = 3, 0.2
# Without anything new for so long, nobody is there or the board cannot be seen.
_PATIENCE_S = 120.0
# Takes of a fast camera would otherwise saturate its Pi with encoding PNGs.
_PAUSE_S = 0.1
# Between two pictures of paint, so that noise, and a hand that nobody holds quite still, differ.
_PAINT_PAUSE_S = 0.2


@dataclass(frozen=True)
class LiveCameras:
    """Running cameras whose pictures go into a folder; all of the rig's if none is named."""

    rig: RigConfig
    names: list[str]
    folder: Path
    connect: str | None = None

    @property
    def endpoints(self) -> list[str]:
        """Where the router is."""
        return endpoints_of(self.rig, self.connect)


async def next_frames(bus: Bus, camera: str, count: int) -> list[Frame]:
    """The next `count` pictures of a running camera, in colour.

    Raises BusError if it sends none.
    """
    frames: list[Frame] = []
    while len(frames) < count:
        picture = (await _ask_all(bus, [camera]))[camera]
        image = _decoded(camera, picture, cv2.IMREAD_COLOR)
        size_px = (image.shape[1], image.shape[0])
        frames.append(Frame(camera, len(frames), 0, 0.0, size_px, image, "bgr"))
        await asyncio.sleep(_PAINT_PAUSE_S if len(frames) < count else 0.0)
    return frames


def one_each(cameras: LiveCameras) -> None:
    """Write one picture of each camera that answers as <camera>.png.

    Raises BusError if none does.
    """
    pictures = uvloop.run(_one_each(cameras))
    cameras.folder.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures.items():
        (cameras.folder / f"{name}.png").write_bytes(picture)


async def _one_each(cameras: LiveCameras) -> dict[str, bytes]:
    pictures: dict[str, bytes] = {}
    async with router_session(cameras.rig.rig.name, cameras.endpoints) as bus:
        for attempt in range(_ATTEMPTS):
            await asyncio.sleep(_RETRY_S * attempt)
            pictures |= await _ask(bus, [name for name in cameras.names if name not in pictures])
            if len(pictures) == len(cameras.names):
                break
    if not pictures:
        raise BusError(
            f"no camera of {', '.join(cameras.names)} answers; are their trackers running? "
            "`rhot top` shows them"
        )
    return pictures


async def _ask(bus: Bus, names: list[str]) -> dict[str, bytes]:
    """One picture of every camera that answers, asked for at the same time."""
    answers = await asyncio.gather(
        *(bus.get(topics.FRAME, timeout_s=_ANSWER_S, camera=name) for name in names)
    )
    return {name: answer[0] for name, answer in zip(names, answers, strict=True) if answer}


async def _ask_all(bus: Bus, names: list[str]) -> dict[str, bytes]:
    """One picture of every camera; BusError if one does not answer."""
    pictures = await _ask(bus, names)
    silent = [name for name in names if name not in pictures]
    if silent:
        raise BusError(
            f"camera {' and '.join(silent)} sends no picture; is its tracker running? "
            "`rhot top` shows it"
        )
    return pictures


def _decoded(name: str, picture: bytes, mode: int) -> np.ndarray:
    image = cv2.imdecode(np.frombuffer(picture, dtype=np.uint8), mode)
    if image is None:
        raise BusError(f"camera {name!r} answered {len(picture)} bytes that are no picture")
    return image


def collect(cameras: LiveCameras, board: Board | None, square_m: float, count: int) -> Board:
    """Collect `count` positions of the board into the folder as <camera><number>.png; returns the
    board, counted if not given.

    Raises BusError if a camera does not answer, CalibrationError if nothing new is shown for two
    minutes.
    """
    names = cameras.names or [camera.name for camera in cameras.rig.camera]
    for name in names:
        cameras.rig.camera_named(name)
    cameras.folder.mkdir(parents=True, exist_ok=True)
    teller = Terminal()
    teller.line(
        f"show the board to {' and '.join(names)} and hold it still; "
        f"pictures go to {cameras.folder}; Ctrl-C ends early"
    )
    collection = _Collection(cameras.folder, names, square_m, count, teller)
    try:
        uvloop.run(collection.run(board, cameras.rig.rig.name, cameras.endpoints))
    except KeyboardInterrupt:
        teller.line("ended early")
    finally:
        teller.end()
    if collection.board is None:
        raise CalibrationError(f"no board was seen; nothing was written to {cameras.folder}")
    return collection.board


class _Collection:
    """One collecting of board positions, from the first picture to the last."""

    def __init__(
        self, folder: Path, names: list[str], square_m: float, count: int, teller: Terminal
    ) -> None:
        self.board: Board | None = None
        self._folder, self._names, self._teller = folder, names, teller
        self._square_m, self._count = square_m, count
        self._next = _first_free(folder, names)
        self._size: tuple[int, int] | None = None

    async def run(self, board: Board | None, rig_name: str, endpoints: list[str]) -> None:
        """Ask, compare, keep, until there are enough."""
        from services.calibrator.board.live_selection import LiveSelection

        async with router_session(rig_name, endpoints) as bus:
            collector: LiveSelection | None = None
            news_s = time.monotonic()
            while collector is None or not collector.done:
                pictures = await _ask_all(bus, self._names)
                images = {
                    name: await asyncio.to_thread(_decoded, name, picture, cv2.IMREAD_GRAYSCALE)
                    for name, picture in pictures.items()
                }
                if collector is None:
                    board = board or await asyncio.to_thread(self._counted, images)
                    collector = LiveSelection(self._names, board, self._count) if board else None
                if collector is not None and await self._offer(collector, images, pictures):
                    news_s = time.monotonic()
                if time.monotonic() - news_s > _PATIENCE_S:
                    raise CalibrationError(self._given_up(collector))
                await asyncio.sleep(_PAUSE_S)

    async def _offer(
        self, collector: LiveSelection, images: dict[str, np.ndarray], pictures: dict[str, bytes]
    ) -> bool:
        """Whether the position was kept."""
        from services.calibrator.board.live_selection import Verdict

        seen = {
            name: await asyncio.to_thread(_detected, image, collector)
            for name, image in images.items()
        }
        take = collector.offer(seen)
        kept = take.verdict is Verdict.KEPT
        if kept:
            self.board = collector.board
            self._keep(pictures)
            self._teller.line(collector.text())
        self._teller.status(collector.text(take))
        return kept

    def _counted(self, images: dict[str, np.ndarray]) -> Board | None:
        from services.calibrator.board.board import Board
        from services.calibrator.board.board_size import find_board_size

        before, self._size = self._size, find_board_size(images.values())
        # A board that is just coming into the picture is counted too small: two takes must agree.
        if self._size is None or self._size != before:
            self._teller.status("looking for the board: show all of it, and hold it still")
            return None
        self._teller.line(f"a board of {self._size[0]}x{self._size[1]} inner corners")
        return Board(*self._size, self._square_m)

    def _keep(self, pictures: dict[str, bytes]) -> None:
        for name, picture in pictures.items():
            (self._folder / f"{name}_{self._next:02d}.png").write_bytes(picture)
        self._next += 1

    def _given_up(self, collector: LiveSelection | None) -> str:
        state = collector.text() if collector else "no board was seen"
        return (
            f"nothing new was shown for {_PATIENCE_S:.0f} s ({state}); "
            f"the pictures so far are in {self._folder}"
        )


def _detected(image: np.ndarray, collector: LiveSelection) -> Detection | None:
    from services.calibrator.board.detect import detect

    return detect(image, collector.board, quick=True)


def _first_free(folder: Path, names: list[str]) -> int:
    """The first number no picture of these cameras has: those of an earlier try stay."""
    taken = [
        path.stem.removeprefix(f"{name}_")
        for name in names
        for path in folder.glob(f"{name}_*.png")
    ]
    return max((int(number) for number in taken if number.isdigit()), default=0) + 1
