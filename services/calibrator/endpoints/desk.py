"""What a step of a guided calibration works with: the rig, the order, and who is told."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from dataclasses import dataclass

from rhot.bus.bus import Bus
from rhot.files.config import RigConfig
from rhot.messages.calibration import CalibrationOrder
from services.calibrator.guided.found import Found


@dataclass(frozen=True)
class Desk:
    """change takes fields of CalibrationState, offer what may be saved while it goes on."""

    bus: Bus
    config: RigConfig
    order: CalibrationOrder
    change: Callable[..., None]
    offer: Callable[[Found], None]

    def tell(self, progress: float, to_do: str, seen: list[str]) -> None:
        """What a person should do now, and what was seen so far."""
        self.change(
            progress=min(max(progress, 0.0), 1.0),
            to_do=to_do[:1000],
            seen=[line[:1000] for line in seen[:32]],
        )

    def computing(self, text: str) -> None:
        """Everything is collected."""
        self.change(phase="computing", progress=1.0, to_do=text)

    def date(self) -> str:
        """The date that goes into a file."""
        return datetime.datetime.now().astimezone().isoformat(timespec="seconds")
