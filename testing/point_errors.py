"""How far the points of fusion are from a synthetic hand's truth, and what their sigmas say."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS
from rhot.messages import HandPoints
from testing.synthetic_points import START_NS, Motion

# Of a Gaussian in space this squared Mahalanobis distance holds 99.7 %, as three sigmas do of one
# axis.
THREE_SIGMAS = 13.93


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Every point, one row each, in order of time."""

    instants_s: Array  # (n,) since the start
    errors_m: Array  # (n, 3) estimate minus truth
    sigmas_m: Array  # (n, 3)
    measured: Array  # (n,) bool; else predicted

    @property
    def rms_mm(self) -> float:
        """RMS error in space."""
        return 1e3 * float(np.sqrt(np.mean(np.sum(self.errors_m**2, axis=1))))

    @property
    def depth_rms_mm(self) -> float:
        """RMS error along z."""
        return 1e3 * float(np.sqrt(np.mean(self.errors_m[:, 2] ** 2)))

    @property
    def nees(self) -> float:
        """Squared error over variance, mean of all axes: 1 if sigma is consistent."""
        return float(np.mean((self.errors_m / self.sigmas_m) ** 2))

    def within(self, begin_s: float, end_s: float = np.inf) -> PointErrors:
        """The points of a stretch of time."""
        inside = (self.instants_s >= begin_s) & (self.instants_s < end_s)
        return PointErrors(
            self.instants_s[inside],
            self.errors_m[inside],
            self.sigmas_m[inside],
            self.measured[inside],
        )


def squared_distances(errors_m: Array, covariances_m2: Array) -> Array:
    """Squared Mahalanobis distances (n,) of errors (n, 3) by their whole covariances (n, 3, 3)."""
    solved = np.linalg.solve(covariances_m2, errors_m[..., None])[..., 0]
    return np.asarray(np.einsum("ni,ni->n", errors_m, solved))


def share_within(squares: Array) -> float:
    """How many of n squared distances are within three sigmas, per cent; NaN of none."""
    return 100.0 * float(np.mean(squares <= THREE_SIGMAS)) if len(squares) else float("nan")


def point_errors(messages: Iterable[HandPoints], motion: Motion) -> PointErrors:
    """The points of messages against a synthetic hand's motion."""
    rows = []
    for message in messages:
        at_s = (message.stamp_ns - START_NS) * 1e-9
        truth = motion(np.array([at_s]))[0]  # (6, 3)
        for point in message.points:
            error = np.array(point.position_m) - truth[BASIC_LANDMARKS.index(point.name)]
            rows.append([at_s, *error, *point.sigma_m, float(point.source == "measured")])
    table = np.array(rows).reshape(-1, 8)
    return PointErrors(table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7] > 0.5)
