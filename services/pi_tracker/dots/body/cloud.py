"""Dots that hang on nothing that is known: a flat cloud that moves as a whole, and each by itself.

Where a hand does not fit what is filmed (a chain of beads, a plate, another animal's limb), dots go
where they went, most of all with the others. The cloud is where the first picture has it, on a
plane that faces the camera, as far away as makes it as large as a hand: so accelerations of hands
(motion.py) are those of anything filmed. Each dot has a way of its own in this plane; angles of a
posture are these, two of each dot, in units of a finger's length. Pure.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.body.rotations import cross
from services.pi_tracker.dots.body.skeleton import FOCAL

Array = npt.NDArray[np.float64]

# The root mean square of dots' distances from their middle, m, as of a hand's.
_SPREAD_M = 0.05
# Of its own a dot moves as the tip of a finger of this length does whose angles do, m; it returns
# to its place in the cloud if nothing else is known, within so many lengths.
_LENGTH_M, _USUAL = 0.06, 1.0
# The plane faces the camera within so much at the start, rad.
_TILT_RAD = 0.05
_NEAREST_M = 0.05


class Cloud:
    """n dots as a camera sees them at (n, 2) px in the first picture."""

    def __init__(self, places: Array, size_px: tuple[int, int]) -> None:
        self._count = len(places)
        self.angles = 2 * self._count
        self.size = self.moving = 6 + self.angles
        self.least, self.most = np.full(self.angles, -np.inf), np.full(self.angles, np.inf)
        self.person = np.zeros(0)
        self.rows = np.eye(self.angles, self.size, 6)
        self.targets = np.zeros(self.angles)
        self.variances = np.full(self.angles, _USUAL**2)
        self.shares = np.eye(self.angles)
        self.focal_px = FOCAL * max(size_px)
        self.middle_px = 0.5 * (np.array(size_px) - 1.0)
        middle = places.mean(axis=0)
        spread_px = float(np.sqrt(np.mean(np.sum((places - middle) ** 2, axis=1))))
        self._depth_m = self.focal_px * _SPREAD_M / max(spread_px, 1.0)
        scale = self._depth_m / self.focal_px
        self._middle = np.array([*(scale * (middle - self.middle_px)), self._depth_m])
        self._flat = scale * (places - middle)

    def begun(self, sigmas: Array) -> motion.State:
        """The cloud in the first picture, each dot's place known to sigmas (n,), px."""
        posture = np.zeros(self.size)
        posture[:3] = self._middle
        scale = self._depth_m / self.focal_px / _LENGTH_M
        variances = np.concatenate(
            [np.zeros(3), np.full(3, _TILT_RAD**2), np.repeat(scale * sigmas, 2) ** 2]
        )
        return motion.start(
            self, posture, np.eye(3), 1.0, np.zeros(0), np.diag(np.maximum(variances, 1e-10))
        )

    def project(
        self, postures: Array, rotations: Array, sides: Array, facing: Array
    ) -> tuple[Array, Array]:
        """Pixels (k, n, 2) of the dots, and their derivatives (k, n, 2, size)."""
        del sides, facing  # a cloud has neither
        count = len(postures)
        own = _LENGTH_M * postures[:, 6 : self.size].reshape(count, self._count, 2)
        turned = (self._flat + own) @ rotations[:, :, :2].swapaxes(1, 2)
        points = turned + postures[:, None, :3]
        slopes = np.zeros((count, self._count, 3, self.size))
        slopes[..., :3] = np.eye(3)
        for axis in range(3):
            slopes[..., 3 + axis] = cross(np.eye(3)[axis], turned)
        each = np.arange(self._count)
        for k in range(2):
            slopes[:, each, :, 6 + 2 * each + k] = _LENGTH_M * rotations[:, :, k]
        depth = np.maximum(points[..., 2], _NEAREST_M)[..., None]
        over = points[..., :2] / depth
        flat = slopes[..., :2, :] - over[..., None] * slopes[..., 2:3, :]
        return self.focal_px * over + self.middle_px, self.focal_px / depth[..., None] * flat

    def showing(self, postures: Array, rotations: Array, sides: Array, facing: Array) -> Array:
        """1 of each dot (k, n): nobody knows which way it faces."""
        del rotations, sides, facing
        return np.ones((len(postures), self._count))
