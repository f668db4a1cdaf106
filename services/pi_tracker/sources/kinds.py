"""What a kind of frame source is: its words in rig.toml, and what makes its reader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rhot.files.calibration import Exposure, load_exposure
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.sources.reader import Reader


class Request(NamedTuple):
    """What a reader is made from: the [[camera]] table, and what follows its source's colon."""

    config: RigConfig
    table: CameraTable
    rest: str
    # None keeps a capture's own stamps; others start at 0 then.
    start_ns: int | None

    @property
    def path(self) -> Path:
        """The rest as a path; a relative one starts at rig.toml's folder."""
        return Path(self.config.folder) / Path(self.rest).expanduser()

    @property
    def exposure(self) -> Exposure | None:
        """The exposure calibration; None before there is one, as it is made with the camera on."""
        folder, camera = self.config.calibration_dir, self.table.name
        exists = (folder / f"{camera}.exposure.json").exists()
        return load_exposure(folder, camera) if exists else None


class SourceKind(NamedTuple):
    """A kind of source: how rig.toml writes it, and what makes its reader."""

    forms: str
    make: Callable[[Request], Reader]
    takes: Callable[[str], bool] = bool
    # A recording begins with the session and ends; a camera does neither.
    is_file: bool = False
