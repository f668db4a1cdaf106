"""Board pictures from the running cameras: asked for at the same time, kept when they teach
something, written as PNG.

A camera that does not answer, or a person who shows nothing new for two minutes, ends it with an
error; Ctrl-C ends the collecting, and what was collected is used.
"""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from typing import TYPE_CHECKING

import uvloop

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, CalibrationError
from rhot.files.config import RigConfig
from services.cli.router_session import router_session
from services.cli.terminal import Terminal

if TYPE_CHECKING:
    import numpy as np

    from services.calibrator.board.board import Board
    from services.calibrator.board.detect import Detection
    from services.calibrator.board.live_selection import LiveSelection

# A lossless 5 Mpx PNG takes a Pi 3 about a second to encode, and a slow network another one.
_ANSWER_S = 5.0
# Asked again this often, a fifth of a second later, then two: a router knows of a tracker that has
# just come up by then.
_ATTEMPTS = 3
# Without anything new for so long, nobody is there or the board cannot be seen.
_PATIENCE_S = 120.0
# Takes of a fast camera would otherwise saturate its Pi with encoding PNGs.
_PAUSE_S = 0.1


def collect(
    rig: RigConfig,
    names: list[str],
    folder: Path,
    board: Board | None,
    square_m: float,
    count: int,
    connect: str | None,
) -> Board:
    """Collect `count` positions of the board into the folder as <camera><number>.png; returns the
    board, counted if not given.

    Raises BusError if a camera does not answer, CalibrationError if nothing new is shown for two
    minutes.
    """
    names = names or [camera.name for camera in rig.camera]
    for name in names:
        rig.camera_named(name)
    folder.mkdir(parents=True, exist_ok=True)
    teller = Terminal()
    teller.line(
        f"show the board to {' and '.join(names)} and hold it still; pictures go to {folder}; Ctrl-C ends early"
    )
    job = _Job(rig, names, folder, square_m, count, teller)
    try:
        uvloop.run(job.run(board, [connect] if connect else list(rig.bus.connect)))
    except KeyboardInterrupt:
        teller.line("ended early")
    finally:
        teller.end()
    if job.board is None:
        raise CalibrationError(f"no board was seen; nothing was written to {folder}")
    return job.board


def one_each(rig: RigConfig, names: list[str], folder: Path, connect: str | None) -> None:
    """Write one picture of each camera that answers as <camera>.png.

    Raises BusError if none does.
    """
    pictures = uvloop.run(_one_each(rig, names, [connect] if connect else list(rig.bus.connect)))
    folder.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures.items():
        (folder / f"{name}.png").write_bytes(picture)


async def _one_each(rig: RigConfig, names: list[str], endpoints: list[str]) -> dict[str, bytes]:
    pictures: dict[str, bytes] = {}
    async with router_session(rig.rig.name, endpoints) as bus:
        for attempt in range(_ATTEMPTS):
            await asyncio.sleep(0.2 * attempt)
            pictures |= await _ask(bus, [name for name in names if name not in pictures])
            if len(pictures) == len(names):
                break
    if not pictures:
        raise BusError(
            f"no camera of {', '.join(names)} answers; are their trackers running? `rhot top` shows them"
        )
    return pictures


async def _ask(bus: Bus, names: list[str]) -> dict[str, bytes]:
    """One picture of every camera that answers, asked for at the same time."""
    answers = await asyncio.gather(
        *(bus.get(topics.FRAME, timeout_s=_ANSWER_S, camera=name) for name in names)
    )
    return {name: answer[0] for name, answer in zip(names, answers, strict=True) if answer}


class _Job:
    """One collecting, from the first picture to the last."""

    def __init__(
        self,
        rig: RigConfig,
        names: list[str],
        folder: Path,
        square_m: float,
        count: int,
        teller: Terminal,
    ) -> None:
        self.board: Board | None = None
        self._rig, self._names, self._folder = rig, names, folder
        self._square_m, self._count, self._teller = square_m, count, teller
        self._next = _first_free(folder, names)
        self._size: tuple[int, int] | None = None

    async def run(self, board: Board | None, endpoints: list[str]) -> None:
        """Ask, judge, keep, until there are enough."""
        from services.calibrator.board.live_selection import LiveSelection, Verdict

        async with router_session(self._rig.rig.name, endpoints) as bus:
            collector: LiveSelection | None = None
            news_s = time.monotonic()
            while collector is None or not collector.done:
                pictures = await self._pictures(bus)
                images = {
                    name: await asyncio.to_thread(_decoded, name, picture)
                    for name, picture in pictures.items()
                }
                if collector is None:
                    board = board or await asyncio.to_thread(self._counted, images)
                    collector = LiveSelection(self._names, board, self._count) if board else None
                if collector is not None:
                    take = collector.offer(
                        {
                            name: await asyncio.to_thread(_seen, image, collector)
                            for name, image in images.items()
                        }
                    )
                    if take.verdict is Verdict.KEPT:
                        self.board = collector.board
                        self._keep(pictures)
                        news_s = time.monotonic()
                        self._teller.line(collector.text())
                    self._teller.status(collector.text(take))
                if time.monotonic() - news_s > _PATIENCE_S:
                    raise CalibrationError(self._given_up(collector))
                await asyncio.sleep(_PAUSE_S)

    async def _pictures(self, bus: Bus) -> dict[str, bytes]:
        pictures = await _ask(bus, self._names)
        silent = [name for name in self._names if name not in pictures]
        if silent:
            raise BusError(
                f"camera {' and '.join(silent)} sends no picture; is its tracker running? `rhot top` shows it"
            )
        return pictures

    def _counted(self, images: dict[str, np.ndarray]) -> Board | None:
        from services.calibrator.board.board import Board
        from services.calibrator.board.board_size import guess_corners

        before, self._size = self._size, guess_corners(images.values())
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
        return f"nothing new was shown for {_PATIENCE_S:.0f} s ({state}); the pictures so far are in {self._folder}"


def _seen(image: np.ndarray, collector: LiveSelection) -> Detection | None:
    from services.calibrator.board.detect import detect

    return detect(image, collector.board, quick=True)


def _decoded(name: str, picture: bytes) -> np.ndarray:
    import cv2
    import numpy as np

    image = cv2.imdecode(np.frombuffer(picture, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise BusError(f"camera {name!r} answered {len(picture)} bytes that are no picture")
    return image


def _first_free(folder: Path, names: list[str]) -> int:
    """The first number no picture of these cameras has: pictures of an earlier try stay and count."""
    taken = [
        path.stem.removeprefix(f"{name}_")
        for name in names
        for path in folder.glob(f"{name}_*.png")
    ]
    return max((int(number) for number in taken if number.isdigit()), default=0) + 1
