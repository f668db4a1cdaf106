"""What the tests of the Kalman filter share: one hand's filter, fed with looks at known points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import extrinsics
from services.fusion.kalman.frame_update import FrameLooks
from services.fusion.kalman.hand_filter import HandFilter
from services.fusion.kalman.held import ESTIMATES
from services.fusion.method import Counts, Estimates, no_estimates
from testing.synthetic_points import Motion, MovingHand, SyntheticRig


class OneHand:
    """The filter of a hand of six before a pair of cameras 16.7 ms apart at 30 fps."""

    SIGMA = 1e-4  # of each ray coordinate

    def __init__(self, path: Motion | None = None, seed: int = 1) -> None:
        self.path: Motion = path or MovingHand(seed=seed)
        self.counts = Counts()
        self.cameras = extrinsics(tuple(SyntheticRig().rig().values()))
        self.filter = HandFilter(
            6, self.cameras, np.array([0.15]), 2.0, self.counts, 60.0, np.full(2, 1 / 30)
        )
        self._random = np.random.default_rng(seed)

    def frame(self, k: int) -> tuple[int, Array, Array]:
        """Camera, times (6,) and noisy rays (6, 2) of the k-th frame of both cameras."""
        camera = k % 2
        times_s = k / 60.0 + np.linspace(-0.003, 0.003, 6)
        points = self.path(times_s[None, :].repeat(1, axis=0))[0]  # (6, 3)
        q = points @ self.cameras.R[camera].T + self.cameras.t[camera]
        return camera, times_s, q[:, :2] / q[:, 2:] + self._random.normal(0.0, self.SIGMA, (6, 2))

    def see(self, frame: tuple[int, Array, Array], seen: Sequence[int] = range(6)) -> None:
        """Take in the looks of a frame at some landmarks."""
        camera, times_s, rays = frame
        which = np.array(list(seen), dtype=np.int64)
        sigmas = np.full(len(which), self.SIGMA)
        self.filter.observe(FrameLooks(camera, which, times_s[which], rays[which], sigmas, 1e-10))

    def errors_m(self, time_s: float) -> tuple[Array, Array]:
        """Which landmarks (6,) have an estimate, and how far it is off (6, 3)."""
        told = self.told(time_s)
        return told.found, told.positions_m - self.path(np.array([time_s]))[0]

    def told(self, time_s: float) -> Estimates:
        """What is known at an instant."""
        told = no_estimates(6, 2)
        self.filter.tell(time_s, np.full(2, 0.05), ESTIMATES.pack(told))
        return told

    def run(self, numbers: Iterable[int]) -> None:
        """Take in whole frames."""
        for k in numbers:
            self.see(self.frame(k))


@pytest.fixture(scope="session")
def one_hand() -> type[OneHand]:
    """A hand of which nothing was seen yet."""
    return OneHand
