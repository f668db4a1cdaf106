"""What a registration gives. Pure data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from rhot.geometry.transforms import Array
from services.calibrator.objects.bundle.tracker_noise import Noise


class Residuals(NamedTuple):
    """Robust RMS of reprojections over one axis: px, and mm at the paint's depth."""

    px: float
    mm: float


@dataclass(frozen=True, eq=False)
class TrackerPlace:
    """The paint in one tracker's own frame, and how late the tracker's stamps are; one standard
    deviation of each.
    """

    marker_m: Array  # (3,)
    marker_sigma_m: Array  # (3,)
    time_offset_ns: int
    time_offset_sigma_ns: int


@dataclass(frozen=True, eq=False)
class ObjectRegistration:
    """The lighthouses' frame in the rig, and how well it is known.

    covariance (6, 6) is of a small turn (rad) and shift (m) in the rig frame about middle_m;
    sigma_rad and sigma_m are the standard deviations of their lengths. extent_m is how far the
    paint reached along the three main directions of its motion, largest first. residual and
    held_out are robust RMS an axis, held_out on seconds that took no part in the fit. noise is
    what the residuals show of the cameras' and of the tracker's errors.
    """

    T_rig_from_lighthouse: Array  # (4, 4)
    trackers: dict[str, TrackerPlace]
    universe: str
    covariance: Array  # (6, 6)
    middle_m: Array  # (3,)
    sigma_m: float
    sigma_rad: float
    residual: Residuals
    held_out: Residuals
    inliers: int
    rejected: int
    rejected_poses: int
    seconds: float
    extent_m: Array  # (3,)
    noise: Noise
