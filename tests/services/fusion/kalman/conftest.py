"""What the tests of the Kalman filter share: one landmark's track."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.frame_rays import Observation
from services.fusion.kalman.motion_model import ACCELERATION_TIME_S
from services.fusion.kalman.rest.rigid_body import RestState, empty_rest, start_body
from services.fusion.kalman.smoother import smooth_all
from services.fusion.kalman.track_history import empty_history, start_track
from services.fusion.kalman.track_insertion import ACCEPTED, insert
from testing.synthetic_points import SyntheticRig


class OneTrack:
    """The track of one landmark, before a pair of cameras."""

    START_M = np.array([0.05, 0.0, 0.6])
    SIGMA = 1e-4  # of each ray coordinate

    def __init__(
        self, densities: Sequence[float] = (40.0,), start_s: float = 0.0, along: float = 0.0
    ) -> None:
        """densities: of the models' jerk, and along the way as well; all slow down alike."""
        self.cameras = extrinsics(tuple(SyntheticRig().rig().values()))
        self.models = np.array(
            [[density, 0.0, 1.0 / ACCELERATION_TIME_S, along] for density in densities]
        )
        self.history = empty_history(1, len(densities))
        start_track(self.history, 0, start_s, self.START_M, np.array([0.02, 0.5, 5.0]))

    def seen(self, camera: int, point: Array, random: np.random.Generator) -> Array:
        """The noisy ray (2,) of a point (3,)."""
        q = self.cameras.R[camera] @ point + self.cameras.t[camera]
        return q[:2] / q[2] + random.normal(0.0, self.SIGMA, 2)

    def add(self, time_s: float, camera: int, ray: Array, gate: float = np.inf) -> int:
        """What became of an observation."""
        observed = Observation(time_s, camera, ray, self.SIGMA**2, 0.0)
        return int(insert(self.history, 0, observed, gate, self.cameras, self.models))

    def at(self, time_s: float) -> tuple[Array, Array]:
        """Mean (3,) and covariance (3, 3) of the position at an instant."""
        means, covs = np.zeros((1, 3)), np.zeros((1, 3, 3))
        assert smooth_all(self.history, time_s, self.models, means, covs)[0]
        return means[0], covs[0]

    def newest(self) -> int:
        """The latest node."""
        return int(self.history.order[0, self.history.size[0] - 1])


class CurvedTrack(OneTrack):
    """It has 12 observations of a landmark on a curved path, inserted in some order."""

    def __init__(self, order: Sequence[int] = tuple(range(12)), along: float = 0.0) -> None:
        super().__init__(start_s=-0.001, along=along)
        random = np.random.default_rng(4)
        self.observed = []  # time, camera, ray
        for k in range(12):
            time_s = k / 60.0 + 0.001 * random.random()
            moved = np.array([0.3 * time_s, 0.2 * np.sin(4 * time_s), -0.2 * time_s**2])
            self.observed.append((time_s, k % 2, self.seen(k % 2, self.START_M + moved, random)))
        for k in order:
            assert self.add(*self.observed[k]) == ACCEPTED


@pytest.fixture(scope="session")
def one_track() -> type[OneTrack]:
    """A track without observations."""
    return OneTrack


@pytest.fixture(scope="session")
def curved_track() -> type[CurvedTrack]:
    """A track with 12 observations."""
    return CurvedTrack


@pytest.fixture
def rest() -> RestState:
    """One hand's body and three anchors about its centre, slowly moving."""
    centre = np.array([0.03, 0.01, 0.7])
    made = empty_rest([np.arange(3)])
    start_body(made, 0, 1.0, centre)
    made.anchor[:] = [[0.08, 0.0, 0.0], [0.0, -0.09, 0.01], [-0.05, 0.04, -0.02]]
    made.anchor[:] += centre
    made.anchor_cov[:] = np.eye(3) * 1e-6
    made.probability[:] = 0.9
    random = np.random.default_rng(2)
    made.motion[0, 1:] = random.normal(0.0, [[0.02], [0.1]], (2, 6))
    root = random.normal(0.0, 1e-2, (18, 18))
    made.cov[0] = root @ root.T
    return made
