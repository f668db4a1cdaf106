"""What the scenarios share: a synthetic hand through FusionStep, and its points' errors."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS
from rhot.messages import MarkerFrame
from services.fusion.step import FusionStep
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, point_hands


@dataclass(frozen=True, eq=False)
class Reported:
    """Every point that fusion reported, one row each, in order of time."""

    instants_s: Array  # (n,) since the start
    errors_m: Array  # (n, 3)
    sigmas_m: Array  # (n, 3)
    measured: Array  # (n,) bool

    def rms_mm(self, begin_s: float, end_s: float) -> float:
        """RMS error in space of the points of a stretch of time."""
        inside = (self.instants_s >= begin_s) & (self.instants_s < end_s)
        return 1e3 * float(np.sqrt(np.mean(np.sum(self.errors_m[inside] ** 2, axis=1))))

    def share(self, begin_s: float, end_s: float, *, measured: bool = False) -> float:
        """Points reported over points possible: six for each of 30 frames a second.

        measured: of the points only those with a measurement.
        """
        inside = (self.instants_s >= begin_s) & (self.instants_s < end_s)
        if measured:
            inside &= self.measured
        return float(inside.sum()) / (6 * 30 * (end_s - begin_s))

    def outlier_share(self) -> float:
        """Share of points that are more than five sigmas off."""
        return float(np.mean(np.sqrt(np.mean((self.errors_m / self.sigmas_m) ** 2, axis=1)) > 5.0))


@pytest.fixture
def run_fusion() -> Callable[..., tuple[FusionStep, Reported]]:
    """Frames -> FusionStep -> all points it reported, against the truth."""

    def run(
        setup: SyntheticRig,
        given: Iterable[MarkerFrame],
        path: MovingHand,
        fusion: Fusion | None = None,
    ) -> tuple[FusionStep, Reported]:
        step = FusionStep(setup.config(fusion), setup.rig(), point_hands())
        messages = [message for frame in given for message in step.step(frame)] + step.flush()
        rows = []
        # Alike in tests/services/fusion/conftest.py, where other columns are needed.
        for message in messages:
            at_s = (message.stamp_ns - START_NS) * 1e-9
            truth = path(np.array([at_s]))[0]
            for point in message.points:
                error = np.array(point.position_m) - truth[BASIC_LANDMARKS.index(point.name)]
                rows.append([at_s, *error, *point.sigma_m, float(point.source == "measured")])
        table = np.array(rows).reshape(-1, 8)
        return step, Reported(table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7] > 0.5)

    return run
