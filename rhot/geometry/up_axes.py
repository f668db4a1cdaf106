"""Which way of a frame is up, and what turns it so that it is +y, as most programs have it."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import rotation_x

# Rotations (3, 3) from a frame with that axis up to one with y up.
UPS = {
    "y": np.eye(3),
    "-y": rotation_x(np.pi),
    "z": rotation_x(-np.pi / 2),
    "-z": rotation_x(np.pi / 2),
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "-x": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
