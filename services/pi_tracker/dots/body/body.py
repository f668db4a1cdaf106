"""What dots may hang on, as their motion and the search for them know it.

A posture is a vector of numbers: the body's place in the camera's frame (3, m), its turn since its
rotation (3, rad), angles (radians of joints, or shares of what they are for another body), then
what does not move of it. Many postures at a time (k of them). Pure.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Body(Protocol):
    """A hand (skeleton.py), or dots that hang on nothing that is known (cloud.py)."""

    # Of a posture: all, what moves, and how many angles are in that.
    size: int
    moving: int
    angles: int
    # The angles' least and most, (angles,).
    least: Array
    most: Array
    # How much what does not move of it may differ, sigmas.
    person: Array
    # What is usual as linear rows (r, size) with targets and variances (r,).
    rows: Array
    targets: Array
    variances: Array
    # Covariance (angles, angles) of accelerations, one that is sharp having about 1.
    shares: Array

    def project(
        self, postures: Array, rotations: Array, sides: Array, facing: Array
    ) -> tuple[Array, Array]:
        """Pixels (k, n, 2) of the dots, and their derivatives (k, n, 2, size)."""

    def showing(self, postures: Array, rotations: Array, sides: Array, facing: Array) -> Array:
        """How far each dot is turned to the camera (k, n): 1 faces it, below 0 it faces away."""
