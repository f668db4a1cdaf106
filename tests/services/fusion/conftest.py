"""What the tests of fusion share: a pair of cameras, and the errors of a run against the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from rhot.geometry.camera import Camera
from rhot.messages import HandPoints, MarkerFrame
from services.fusion.intake.observations import ObservationBuilder
from services.fusion.kalman.estimator import KalmanMethod
from services.fusion.step import FusionStep
from testing.point_errors import PointErrors, point_errors
from testing.synthetic_points import START_NS, Motion, SyntheticRig, frames, point_hands

# Tracks have started and clock offsets are estimated by then.
WARM_S = 1.0


def track(
    setup: SyntheticRig, given: Iterable[MarkerFrame], fusion: Fusion | None = None
) -> tuple[FusionStep, list[HandPoints]]:
    step = FusionStep(setup.config(fusion), setup.rig(), point_hands())
    messages = [points for frame in given for points in step.step(frame)]
    return step, messages + step.flush()


Run = Callable[..., tuple[FusionStep, PointErrors]]


@pytest.fixture(scope="session")
def run() -> Run:
    """Synthetic hand -> FusionStep -> errors after WARM_S."""

    def simulate(
        setup: SyntheticRig, path: Motion, fusion: Fusion | None = None, seconds: float = 6.0
    ) -> tuple[FusionStep, PointErrors]:
        step, messages = track(setup, frames(setup, path, seconds), fusion)
        return step, point_errors(messages, path).within(WARM_S)

    return simulate


@pytest.fixture(scope="session")
def fuse() -> Callable[..., tuple[FusionStep, list[HandPoints]]]:
    """Frames -> FusionStep -> all its messages."""
    return track


@pytest.fixture
def pair() -> tuple[Camera, Camera]:
    """Two cameras that are neither parallel nor level nor of one focal length."""
    left, right = SyntheticRig(toe_in_rad=0.05).rig().values()
    tilted = right.T_rig_from_camera.copy()
    tilted[:3, 3] += [0.0, 0.004, -0.01]
    return left, Camera(
        "right",
        right.size_px,
        right.matrix * np.array([[1.1], [1.1], [1.0]]),
        right.distortion,
        tilted,
    )


class Bench:
    """A KalmanMethod fed with frames, without the rest of fusion."""

    def __init__(
        self,
        setup: SyntheticRig,
        fusion: Fusion | None = None,
        hands: Iterable[Iterable[int]] = (range(6),),
    ) -> None:
        self.cameras = setup.rig()
        self.builder = ObservationBuilder(setup.config(), self.cameras)
        periods_s = np.full(len(self.cameras), 1.0 / setup.fps)
        groups = [np.array(list(hand), dtype=np.int64) for hand in hands]
        self.method = KalmanMethod(
            groups, tuple(self.cameras.values()), periods_s, fusion or Fusion()
        )

    def see(self, frame: MarkerFrame) -> float:
        """Take in a frame; its instant in s, as synthetic_points counts."""
        view = self.builder.build(frame)
        instant_s = (view.instant_ns - START_NS) * 1e-9
        self.method.observe(view, instant_s + view.delay_s, view.clock_sigma_s)
        return instant_s


@pytest.fixture(scope="session")
def bench_of() -> type[Bench]:
    """The filter alone."""
    return Bench
