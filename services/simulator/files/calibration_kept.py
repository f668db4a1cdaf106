"""The calibration that a simulator began with, kept: it is the truth of its world, and whoever
practises a calibration writes new files beside rig.toml while it runs.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import msgspec

from rhot.files.config import RigConfig


def calibration_kept(config: RigConfig, folder: Path) -> RigConfig:
    """The same rig with a copy of its calibration in that folder, which OSError says is full."""
    for path in sorted(config.calibration_dir.glob("*.json")):
        shutil.copy(path, folder / path.name)
    rig = msgspec.structs.replace(config.rig, calibration=str(folder.resolve()))
    return msgspec.structs.replace(config, rig=rig)
