"""What the tests of fusion share: a pair of cameras, and the errors of a run against the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import pytest

from rhot.files.config import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS
from rhot.messages import HandPoints, MarkerFrame
from services.fusion.intake.observations import ObservationBuilder
from services.fusion.kalman.estimator import KalmanMethod
from services.fusion.step import FusionStep
from testing.synthetic_points import START_NS, Motion, SyntheticRig, frames, point_hands


@dataclass(frozen=True, eq=False)
class Score:
    """Errors of points against truth, after `warm_s`."""

    messages: int
    errors_m: Array  # (n, 3)
    sigmas_m: Array  # (n, 3)
    instants_s: Array  # (n,)
    measured: Array  # (n,)

    @property
    def rms_mm(self) -> float:
        return 1e3 * float(np.sqrt(np.mean(np.sum(self.errors_m**2, axis=1))))

    @property
    def depth_rms_mm(self) -> float:
        return 1e3 * float(np.sqrt(np.mean(self.errors_m[:, 2] ** 2)))

    @property
    def nees(self) -> float:
        """Squared error over variance, mean of all axes: 1 if sigma is consistent."""
        return float(np.mean((self.errors_m / self.sigmas_m) ** 2))


def score(messages: Iterable[HandPoints], path: Motion, warm_s: float = 1.0) -> Score:
    messages = [m for m in messages if (m.stamp_ns - START_NS) * 1e-9 >= warm_s]
    rows = []
    for message in messages:
        instant_s = (message.stamp_ns - START_NS) * 1e-9
        truth = path(np.array([instant_s]))[0]
        for point in message.points:
            error = np.array(point.position_m) - truth[BASIC_LANDMARKS.index(point.name)]
            rows.append([*error, *point.sigma_m, instant_s, float(point.source == "measured")])
    table = np.array(rows).reshape(-1, 8)
    return Score(len(messages), table[:, :3], table[:, 3:6], table[:, 6], table[:, 7])


def track(
    setup: SyntheticRig, given: Iterable[MarkerFrame], fusion: Fusion | None = None
) -> tuple[FusionStep, list[HandPoints]]:
    step = FusionStep(setup.config(fusion), setup.rig(), point_hands())
    messages = [points for frame in given for points in step.step(frame)]
    return step, messages + step.flush()


Run = Callable[..., tuple[FusionStep, Score]]


@pytest.fixture(scope="session")
def run() -> Run:
    """Synthetic hand -> FusionStep -> score."""

    def simulate(
        setup: SyntheticRig, path: Motion, fusion: Fusion | None = None, seconds: float = 6.0
    ) -> tuple[FusionStep, Score]:
        step, messages = track(setup, frames(setup, path, seconds), fusion)
        return step, score(messages, path)

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
