"""Pictures from the running cameras: the next ones of one camera, one of each, or positions of a
board, asked for at the same time, kept when they add something, written as PNG.

A camera that does not answer, or a person who shows nothing new for two minutes, ends it with an
error; Ctrl-C ends the collecting, and what was collected is used.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import uvloop

from rhot.bus.bus import Bus
from rhot.errors import BusError, CalibrationError
from rhot.files.config import RigConfig
from services.calibrator.endpoints.board_positions import BoardCollection, ask, ask_all, decoded
from services.cli.router_session import endpoints_of, router_session
from services.cli.terminal import Terminal
from services.pi_tracker.image.frame import Frame

if TYPE_CHECKING:
    from services.calibrator.board.board import Board

# Asked again this often, a fifth of a second later, then two: a router knows of a tracker that has
# just come up by then.
_ATTEMPTS, _RETRY_S = 3, 0.2
# Between two pictures of paint, so that noise, and a hand that nobody holds quite still, differ;
# and of a hand that moves, so that it is elsewhere.
STILL_PAUSE_S, MOVING_PAUSE_S = 0.2, 0.4


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


async def next_frames(
    bus: Bus, camera: str, count: int, pause_s: float = STILL_PAUSE_S
) -> list[Frame]:
    """The next `count` pictures of a running camera, in colour, so far apart.

    Raises BusError if it sends none.
    """
    frames: list[Frame] = []
    while len(frames) < count:
        picture = (await ask_all(bus, [camera]))[camera]
        image = decoded(camera, picture, cv2.IMREAD_COLOR)
        size_px = (image.shape[1], image.shape[0])
        frames.append(Frame(camera, len(frames), 0, 0.0, size_px, image, "bgr"))
        await asyncio.sleep(pause_s if len(frames) < count else 0.0)
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
            pictures |= await ask(bus, [name for name in cameras.names if name not in pictures])
            if len(pictures) == len(cameras.names):
                break
    if not pictures:
        raise BusError(
            f"no camera of {', '.join(cameras.names)} answers; are their trackers running? "
            "`rhot top` shows them"
        )
    return pictures


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
    numbers = itertools.count(_first_free(cameras.folder, names))

    def keep(pictures: Mapping[str, bytes]) -> None:
        number = next(numbers)
        for name, picture in pictures.items():
            (cameras.folder / f"{name}_{number:02d}.png").write_bytes(picture)

    collection = BoardCollection(names, square_m, count, teller, keep)
    try:
        uvloop.run(_run(collection, cameras, board))
    except CalibrationError as error:
        raise CalibrationError(f"{error}; the pictures so far are in {cameras.folder}") from None
    except KeyboardInterrupt:
        teller.line("ended early")
    finally:
        teller.end()
    if collection.board is None:
        raise CalibrationError(f"no board was seen; nothing was written to {cameras.folder}")
    return collection.board


async def _run(collection: BoardCollection, cameras: LiveCameras, board: Board | None) -> None:
    async with router_session(cameras.rig.rig.name, cameras.endpoints) as bus:
        await collection.run(bus, board)


def _first_free(folder: Path, names: list[str]) -> int:
    """The first number no picture of these cameras has: those of an earlier try stay."""
    taken = [
        path.stem.removeprefix(f"{name}_")
        for name in names
        for path in folder.glob(f"{name}_*.png")
    ]
    return max((int(number) for number in taken if number.isdigit()), default=0) + 1
