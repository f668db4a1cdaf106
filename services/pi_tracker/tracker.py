"""One camera's tracker: its step, the colour ranges it uses, and the watch over their drift. Pure.

New ranges are prepared first, which may fail, and used from the next frame on: the endpoints decide
when (endpoints/color_ranges.py), the service feeds the frames (service.py).
"""

from __future__ import annotations

from collections.abc import Callable

from rhot.clock import Offset
from rhot.files.calibration import Colors
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from rhot.messages import MarkerFrame
from rhot.messages.camera import SeenInPicture
from services.pi_tracker.colors.light_drift import Drifted, DriftMonitor
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.pi_tracker.step import TrackerStep


class CameraTracker:
    """Finds one camera's markers with the ranges it was last told to use.

    Until `use` is called there is no step, and `step` must not be called.
    """

    def __init__(
        self, config: RigConfig, camera: CameraTable, clock: Callable[[], int] | None = None
    ) -> None:
        """clock, if given, times the stages of each step, in ns."""
        self.camera = camera
        self.colors_path = config.calibration_dir / f"{camera.name}.colors.json"
        self.colors = Colors(colors={})
        self._config, self._clock = config, clock
        self._step: TrackerStep
        self._drift: DriftMonitor

    def wanted(self, colors: Colors) -> list[str]:
        """The colours that rig.toml's hands use; without a hand, all that there are."""
        return self._config.tracked_colors(colors.colors)

    def calibrated(self, colors: Colors) -> list[str]:
        """Those of the wanted colours that have a range."""
        return [name for name in self.wanted(colors) if name in colors.colors]

    def prepare(self, colors: Colors, names: list[str]) -> TrackerStep:
        """A step that looks for the named colours.

        Raises CalibrationError if one of them has no range, or the lens is needed and missing.
        """
        return step_of_rig(
            self._config,
            self.camera.name,
            colors,
            names,
            clock=self._clock,
            colors_path=self.colors_path,
        )

    def use(self, colors: Colors, step: TrackerStep) -> None:
        """Track with a prepared step from the next frame on."""
        self.colors, self._step, self._drift = colors, step, DriftMonitor(colors)

    def step(self, frame: Frame, offset: Offset) -> MarkerFrame:
        """The markers of one frame; offset is that of the camera's clock."""
        return self._step.step(frame, offset.offset_ns, offset.sigma_ns)

    def seen(self, found: MarkerFrame) -> SeenInPicture:
        """What people are told of the picture of the last step, and of nothing else."""
        return self._step.seen(found)

    @property
    def times_ms(self) -> dict[str, float]:
        """Duration of each stage of the last step."""
        return self._step.times_ms

    def watch_drift(
        self, frame: Frame, found: MarkerFrame
    ) -> tuple[dict[str, float], list[Drifted] | None]:
        """Figures for health, and the colours that have drifted; none and None between checks."""
        if not self._drift.update(frame, found.markers):
            return {}, None
        return self._drift.values(), self._drift.drifted()
