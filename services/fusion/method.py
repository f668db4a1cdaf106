"""What every method of fusion offers: observations of one camera in, landmarks at an instant out.

FusionStep owns one of the three (kalman, triangulate, disparity) and knows no more of it than
this.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.intake.observations import View


class Estimates(NamedTuple):
    """All L landmarks at one instant, rig frame; rows whose `found` is false hold nothing.

    Arrays hold until the method is asked again.
    """

    found: Bools  # (L,)
    positions_m: Array  # (L, 3)
    covariances_m2: Array  # (L, 3, 3)
    seen_by: Bools  # (L, C) which cameras saw it about then
    measured: Bools  # (L,) two or more did; else it is predicted
    detected: Bools  # (L,) two or more detected something of its colour then, gated or not

    def of(self, rows: slice) -> Estimates:
        """Those of some landmarks; views."""
        return Estimates(
            found=self.found[rows],
            positions_m=self.positions_m[rows],
            covariances_m2=self.covariances_m2[rows],
            seen_by=self.seen_by[rows],
            measured=self.measured[rows],
            detected=self.detected[rows],
        )


def no_estimates(landmarks: int, cameras: int) -> Estimates:
    """To be filled in place."""
    flags = np.zeros((3, landmarks), dtype=np.bool_)
    return Estimates(
        found=flags[0],
        positions_m=np.zeros((landmarks, 3)),
        covariances_m2=np.zeros((landmarks, 3, 3)),
        seen_by=np.zeros((landmarks, cameras), dtype=np.bool_),
        measured=flags[1],
        detected=flags[2],
    )


@dataclass
class Counts:
    """What became of observations and landmarks since the start."""

    accepted: int = 0
    gated: int = 0  # contradicts the track
    late: int = 0  # older than all that is remembered
    refused: int = 0  # rays that do not meet in front of the cameras
    started: int = 0
    dropped: int = 0
    incoherent: int = 0  # points that do not belong to the hand they claim


class Method(Protocol):
    """One way from observations to points.

    Times are seconds since an instant that FusionStep chose.
    """

    counts: Counts
    # Frames of the reference camera that a result waits for at least, beyond what the user asked.
    frames_after: int

    def observe(self, view: View, times_s: Array, clock_sigma_s: float) -> None:
        """Take in a frame.

        times_s (n,) are the observations' own instants, in any order from frame to frame.
        clock_sigma_s is how far the camera's clock may be off the other cameras'.
        """
        ...

    def estimate(self, time_s: float) -> Estimates:
        """Where the landmarks are at an instant, as far as the observations so far tell.

        May be asked once for each, ascending.
        """
        ...

    def settle(self) -> None:
        """Do what the last estimates do not wait for; estimate() does it where nobody has."""
        ...

    def reset(self) -> None:
        """Forget all observations: time starts anew."""
        ...
