"""The RHOT paper's depth law D = k * x^z, fitted to measured distances: D in cm, x the disparity in
px, equations (9) and (10). Pure.

The law has two parameters where stereo geometry has none: D = f B / x for parallel cameras, if the
tape measures from their optical centres. So the same measurements are also explained by the two
errors that bend them: a divergence of the cameras (a constant offset of the disparity) and an
offset of the tape's zero. Distances that cover too short a range, or disparities that do not fall
with distance, raise a CalibrationError.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array

# Two distances fix two parameters; residuals mean something from five on, over a range of at least
# 1 : 1.5.
_MIN_ROWS, _MIN_RANGE = 5, 1.5
# log D over log x is a line of slope -1 or nearly; anything less correlated is no disparity.
_MAX_CORRELATION = -0.9
# Gauss-Newton on an almost linear problem: 20 rounds are far more than it takes.
_ROUNDS = 20


@dataclass(frozen=True)
class StereoPair:
    """Two parallel cameras: focal length, distance of the optical centres, width of the picture."""

    focal_px: float
    baseline_cm: float
    width_px: int


# RHOT section 9.2: 640 px over 62.5 degrees, cameras 75 mm apart.
PAPER_PAIR = StereoPair(focal_px=527.3, baseline_cm=7.5, width_px=640)
# RHOT section 9.2, the trendline of its measurements.
PAPER_K, PAPER_Z = 4543.3, -1.035


@dataclass(frozen=True)
class DepthLaw:
    """k (cm px^-z) and z of eq. (9), phi_rad of eq. (10) with z = -1, and how well they fit.

    Residuals in cm, fitted minus measured, by distance: power_cm of k x^z, geometry_cm of k / x,
    explained_cm of stereo geometry with two errors. Those are divergence_rad, the angle between
    the optical axes (positive: the cameras look away from each other), and zero_cm, how far the
    tape's zero lies in front of the optical centres.
    """

    k: float
    z: float
    phi_rad: float
    distances_cm: tuple[float, ...]
    disparities_px: tuple[float, ...]
    power_cm: tuple[float, ...]
    geometry_cm: tuple[float, ...]
    divergence_rad: float
    zero_cm: float
    explained_cm: tuple[float, ...]


def fit_depth(
    distances_cm: Sequence[float] | Array,
    disparities_px: Sequence[float] | Array,
    pair: StereoPair = PAPER_PAIR,
) -> DepthLaw:
    """Fit both laws to measured distances (n,) and disparities (n,).

    k and z are the straight line through log D over log x, as a spreadsheet's power trendline is;
    phi makes eq. (10) meet the mean.

    Raises CalibrationError if the measurements do not determine a law.
    """
    D = np.asarray(distances_cm, dtype=np.float64)
    x = np.asarray(disparities_px, dtype=np.float64)
    _check(D, x)
    z, log_k = np.polyfit(np.log(x), np.log(D), 1)
    k = float(np.exp(log_k))
    k_geometry = float(np.exp(np.mean(np.log(D * x))))
    half_view = np.arctan(0.5 * pair.width_px / pair.focal_px)
    phi = float(np.arctan(pair.baseline_cm * pair.width_px / (2.0 * k_geometry)) - half_view)
    focal_times_baseline = pair.focal_px * pair.baseline_cm
    offset_px, zero_cm = _fit_offsets(D, x, focal_times_baseline)
    explained = focal_times_baseline / np.maximum(x - offset_px, 1e-6) - zero_cm - D
    return DepthLaw(
        k=k,
        z=float(z),
        phi_rad=phi,
        distances_cm=tuple(D.tolist()),
        disparities_px=tuple(x.tolist()),
        power_cm=tuple((k * x**z - D).tolist()),
        geometry_cm=tuple((k_geometry / x - D).tolist()),
        divergence_rad=float(offset_px / pair.focal_px),
        zero_cm=float(zero_cm),
        explained_cm=tuple(explained.tolist()),
    )


def _check(D: Array, x: Array) -> None:
    if len(D) != len(x) or len(D) < _MIN_ROWS:
        raise CalibrationError(
            f"{len(D)} distances are too few for a depth law; measure at least {_MIN_ROWS}, "
            "e.g. every 5 cm from 100 to 20 cm"
        )
    if not (np.all(np.isfinite(D)) and np.all(np.isfinite(x)) and D.min() > 0.0 and x.min() > 0.0):
        raise CalibrationError("every distance and disparity must be a positive number")
    if D.max() < _MIN_RANGE * D.min():
        raise CalibrationError(
            f"distances from {D.min():g} to {D.max():g} cm are too close together for a depth law; "
            f"the farthest must be {_MIN_RANGE:g} times the nearest"
        )
    if np.corrcoef(np.log(D), np.log(x))[0, 1] > _MAX_CORRELATION:
        raise CalibrationError(
            "the disparities do not fall as the distances grow; are columns of the CSV swapped, "
            "or the left picture taken for the right one?"
        )


def _fit_offsets(D: Array, x: Array, focal_times_baseline: float) -> tuple[float, float]:
    """Offset (px) and zero (cm) of x = f B / (D + zero) + offset.

    By Gauss-Newton on the disparities.
    """
    offset, zero = 0.0, 0.0
    for _ in range(_ROUNDS):
        depth = np.maximum(D + zero, 1e-3)
        J = np.stack([np.ones_like(D), -focal_times_baseline / depth**2], axis=1)  # (n, 2)
        step = np.linalg.lstsq(J, x - focal_times_baseline / depth - offset, rcond=None)[0]
        offset = offset + float(step[0])
        zero = zero + float(step[1])
    return offset, zero
