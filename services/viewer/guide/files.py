"""What is in a rig's calibration folder: which step is done, since when, and how well.

Files may be written by anybody at any time; one that cannot be read counts as not there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from rhot.errors import UNDECODABLE
from rhot.files.config import RigConfig
from services.viewer.guide.steps import Step

# Larger files are none of these: a hand has 20 kB.
_MAX_BYTES = 5_000_000


@dataclass(frozen=True)
class Done:
    """A step of which all files are there: the oldest's date (ISO, "" if it says none), and the
    worst error, in words.
    """

    date: str
    error: str = ""


class _Any(msgspec.Struct, frozen=True, kw_only=True):
    date: str = ""
    residuals: dict[str, Any] = msgspec.field(default_factory=dict)
    residual_m: float | None = None


class CalibrationFolder:
    """The files of a rig, read again when they have changed."""

    def __init__(self, config: RigConfig) -> None:
        self._config = config
        self._read: dict[Path, tuple[tuple[int, int], _Any | None]] = {}

    def done(self, step: Step) -> Done | None:
        """Whether a step is done; None if a file of it is missing."""
        names = step.files(self._config)
        found = [self._file(self._config.calibration_dir / name) for name in names]
        known = [one for one in found if one is not None]
        if not known or len(known) < len(found):
            return None
        return Done(min(one.date for one in known), _error(step, known))

    def _file(self, path: Path) -> _Any | None:
        try:
            stat = path.stat()
            stamp = (stat.st_mtime_ns, stat.st_size)
            before = self._read.get(path)
            if before is not None and before[0] == stamp:
                return before[1]
            content = None
            if stat.st_size <= _MAX_BYTES:
                content = msgspec.json.decode(path.read_bytes(), type=_Any)
        except (OSError, *UNDECODABLE):
            return None
        self._read[path] = (stamp, content)
        return content


def _error(step: Step, files: list[_Any]) -> str:
    """The worst error of a step's files, with its unit."""
    if step.name == "hand":
        residuals = [one.residual_m for one in files if one.residual_m is not None]
        return f"{1e3 * max(residuals):.1f} mm" if residuals else ""
    values = [one.residuals.get(step.error) for one in files]
    numbers = [float(value) for value in values if isinstance(value, int | float)]
    return f"{max(numbers):.2f} {step.unit}" if numbers else ""
