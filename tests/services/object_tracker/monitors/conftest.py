"""A painted cup before two cameras, and its watch fed with messages as they would arrive."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from rhot.files.calibration import ObjectPlace, Objects
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.geometry.transforms import Array, transform
from rhot.messages import MarkerFrame
from services.object_tracker.monitors.drift_monitor import DriftMonitor
from services.object_tracker.monitors.drift_watch import Drift
from services.object_tracker.step import ObjectStep
from testing.painted_tracker import MARKER_M, PaintedTracker, rows_of
from testing.synthetic_points import START_NS

# From exposure to a marker frame's arrival.
_LATE_NS = 40_000_000


@dataclass
class WatchedCup:
    """One object's poses and pictures through ObjectStep and DriftMonitor."""

    scene: PaintedTracker

    def __post_init__(self) -> None:
        rows = rows_of(self.scene.T_rig_from_lighthouse)
        place = ObjectPlace(
            offset_m=(0.075, 0.0, 0.0),
            orientation_wxyz=(0.70710678, 0.0, 0.0, -0.70710678),
            marker_m=MARKER_M,
        )
        objects = Objects(
            T_rig_from_lighthouse=rows,
            sigma_m=0.0007,
            objects={"cup": place},
        )
        table = ObjectTable(name="cup", serial=self.scene.serial, marker=self.scene.color)
        config = RigConfig(object=[table])
        self.step = ObjectStep(config, objects)
        self.monitor = DriftMonitor(config, objects, self.scene.cameras())

    def run(
        self,
        start_s: float,
        scene: PaintedTracker | None = None,
        moved: Array | None = None,
        change: Callable[[MarkerFrame], MarkerFrame] = lambda frame: frame,
    ) -> Iterator[tuple[float, Drift | None]]:
        """Seconds since the beginning, and what is told at each look, from start_s on."""
        scene = scene or self.scene
        arrivals = [(pose.stamp_ns, 0, pose) for pose in scene.poses(start_s, moved)]
        arrivals += [
            (frame.stamp_ns + _LATE_NS, 1, change(frame)) for frame in scene.frames(start_s)
        ]
        arrivals.sort(key=lambda arrival: arrival[:2])
        look_ns = arrivals[0][0] + 10**9
        for now_ns, _, message in arrivals:
            if isinstance(message, MarkerFrame):
                self.monitor.take_frame(message)
            elif found := self.step.step(message):
                self.monitor.take_object(found)
            if now_ns >= look_ns:
                look_ns += 10**9
                yield (now_ns - START_NS) * 1e-9, self.monitor.look(now_ns).get("cup")


@pytest.fixture
def cup() -> WatchedCup:
    """It is moved and turned."""
    return WatchedCup(PaintedTracker(seconds=12.0))


@pytest.fixture
def resting_cup() -> WatchedCup:
    """It stands still."""
    return WatchedCup(PaintedTracker(seconds=12.0).at_rest())


@pytest.fixture
def watched() -> type[WatchedCup]:
    """For other scenes."""
    return WatchedCup


@pytest.fixture
def bumped() -> Array:
    """A base station turned by half a degree and moved by 5 mm; in the rig frame."""
    from rhot.geometry.transforms import rotation_y

    return transform(rotation_y(np.deg2rad(0.5)), (0.003, 0.004, 0.0))
