"""A board, shown to one camera or to all: told to a page; the lens or the rig that comes of it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from pathlib import Path

from rhot.errors import CalibrationError
from rhot.files.calibration import Lens, load_lens
from rhot.messages.simulator import SimBoard, SimStage
from services.calibrator.board.board import Board
from services.calibrator.board.picture_folder import PictureSet
from services.calibrator.endpoints.board_positions import BoardCollection
from services.calibrator.endpoints.desk import Desk
from services.calibrator.endpoints.picture_folder import picture_folder
from services.calibrator.endpoints.practice import Performer, practising
from services.calibrator.guided.boards import lens_found, rig_found
from services.calibrator.guided.found import Found


async def board_step(desk: Desk) -> Found:
    """Collect positions of the board, then calibrate.

    Raises BusError if a camera does not answer, CalibrationError if there is no board.
    """
    order = desk.order
    if order.step == "lens":
        desk.config.camera_named(order.camera)
        names = [order.camera]
    else:
        names = [camera.name for camera in desk.config.camera]
        if len(names) < 2:
            raise CalibrationError("one camera has no place to others: rig.toml needs two of them")
    with picture_folder() as folder:
        kept = _Kept(folder, names)
        shown = SimBoard(camera=names[0] if len(names) == 1 else "")
        async with practising(desk, SimStage(board=shown)) as performer:
            board = await _collect(desk, names, kept, performer)
        desk.computing("The pictures are compared with each other; this takes up to a minute.")
        pictures = PictureSet(kept.files)
        if order.step == "lens":
            return await asyncio.to_thread(lens_found, order.camera, pictures, board, desk.date())
        lenses = _lenses(desk.config.calibration_dir, names)
        return await asyncio.to_thread(rig_found, pictures, board, lenses, desk.date())


class _Kept:
    """Positions on disk, a PNG of each camera."""

    def __init__(self, folder: Path, names: list[str]) -> None:
        self.files: dict[str, dict[str, Path]] = {name: {} for name in names}
        self._folder = folder

    def keep(self, pictures: Mapping[str, bytes]) -> None:
        """One position more."""
        number = f"{len(next(iter(self.files.values()))) + 1:02d}"
        for name, picture in pictures.items():
            path = self._folder / f"{name}_{number}.png"
            path.write_bytes(picture)
            self.files[name][number] = path


async def _collect(desk: Desk, names: list[str], kept: _Kept, performer: Performer | None) -> Board:
    order = desk.order

    class Teller:
        """The page instead of a terminal."""

        def line(self, text: str) -> None:
            """What is kept is in the status too."""

        def status(self, text: str) -> None:
            """The collection's state in one line: what was seen first, what to do last."""
            parts = text.split("; ")
            done = len(next(iter(kept.files.values())))
            desk.tell(done / order.count, parts[-1], parts[:-1])

    desk.tell(0.0, "show all of the board, and hold it still", [])
    square_m = 1e-3 * order.square_mm
    after_take = performer.after_take if performer else None
    collection = BoardCollection(names, square_m, order.count, Teller(), kept.keep, after_take)
    await collection.run(desk.bus, None)
    if collection.board is None:
        raise CalibrationError("no board was seen")
    return collection.board


def _lenses(folder: Path, names: list[str]) -> dict[str, Lens] | None:
    """The lenses of all cameras, None unless each has one: then they are found with the rig."""
    try:
        return {name: load_lens(folder, name) for name in names}
    except CalibrationError:
        return None
