"""The seed's depth law, fitted to measured distances: D = k * x^z (D in cm, x in px of disparity),
RHOT eq. (9) and (10). Pure.

The law has two numbers where geometry has none: D = f B / x for parallel cameras whose optical
centres are where the tape begins. So the same measurements are also explained by what bends them:
the angle between the cameras (a constant in the disparity) and where the tape's zero lies.
Distances that do not reach over a range, or disparities that do not fall with distance, are
refused.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array

# RHOT section 9.2: 640 px over 62.5 degrees, cameras 75 mm apart, a target at 100 to 20 cm in steps
# of 5 cm.
SEED_FOCAL_PX, SEED_BASELINE_CM, SEED_WIDTH_PX = 527.3, 7.5, 640
SEED_DISTANCES_CM = tuple(float(distance) for distance in range(100, 15, -5))
# RHOT section 9.2, the trendline of its measurements.
SEED_K, SEED_Z = 4543.3, -1.035
# Two distances fix two numbers; residuals mean something from five on, over a range of at least 1 :
# 1.5.
_MIN_ROWS, _MIN_RANGE = 5, 1.5
CSV_HEADER = ("distance_cm", "disparity_px")


@dataclass(frozen=True)
class DepthLaw:
    """k (cm px^-z) and z of eq. (9); phi_rad of eq. (10) with z = -1; residuals in cm by distance,
    of both laws.

    divergence_rad (positive: the cameras look away from each other) and zero_cm (the tape's zero
    lies so far in front of the optical centres) explain the same measurements by geometry, with
    explained_cm as residuals.
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


def read_bench(path: Path) -> tuple[Array, Array]:
    """Distances (n,) cm and disparities (n,) px of a CSV with the header
    `distance_cm,disparity_px`.

    Raises CalibrationError naming the file and line of the first bad row.
    """
    try:
        rows = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CalibrationError(f"{path}: cannot be read: {error}") from None
    if not rows or tuple(cell.strip() for cell in rows[0]) != CSV_HEADER:
        raise CalibrationError(f"{path}: line 1: expected the header `{','.join(CSV_HEADER)}`")
    values = [
        _row(path, number, row)
        for number, row in enumerate(rows[1:], start=2)
        if any(cell.strip() for cell in row)
    ]
    table = np.array(values, dtype=np.float64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _row(path: Path, number: int, row: list[str]) -> tuple[float, float]:
    try:
        distance, disparity = (float(cell) for cell in row)
    except ValueError:
        raise CalibrationError(
            f"{path}: line {number}: expected two numbers, a distance and a disparity, got {','.join(row)!r}"
        ) from None
    if not (
        math.isfinite(distance) and math.isfinite(disparity) and distance > 0.0 and disparity > 0.0
    ):
        raise CalibrationError(
            f"{path}: line {number}: distance and disparity must be positive, got {','.join(row)!r}"
        )
    return distance, disparity


def fit_depth(
    distances_cm: Sequence[float] | Array,
    disparities_px: Sequence[float] | Array,
    focal_px: float = SEED_FOCAL_PX,
    baseline_cm: float = SEED_BASELINE_CM,
    width_px: int = SEED_WIDTH_PX,
) -> DepthLaw:
    """Fit both laws to measured distances (n,) and disparities (n,).

    k and z are the straight line through log D over log x, as a spreadsheet's power trendline is;
    phi makes eq. (10) meet the mean.

    Raises CalibrationError if the measurements cannot carry a law.
    """
    D, x = np.asarray(distances_cm, dtype=np.float64), np.asarray(disparities_px, dtype=np.float64)
    _check(D, x)
    z, log_k = np.polyfit(np.log(x), np.log(D), 1)
    k = float(np.exp(log_k))
    k_geometry = float(np.exp(np.mean(np.log(D * x))))
    half_view = np.arctan(0.5 * width_px / focal_px)
    phi = float(np.arctan(baseline_cm * width_px / (2.0 * k_geometry)) - half_view)
    offset_px, zero_cm = _explain(D, x, focal_px * baseline_cm)
    return DepthLaw(
        k=k,
        z=float(z),
        phi_rad=phi,
        distances_cm=tuple(D.tolist()),
        disparities_px=tuple(x.tolist()),
        power_cm=tuple((k * x**z - D).tolist()),
        geometry_cm=tuple((k_geometry / x - D).tolist()),
        divergence_rad=float(offset_px / focal_px),
        zero_cm=float(zero_cm),
        explained_cm=tuple(
            (focal_px * baseline_cm / np.maximum(x - offset_px, 1e-6) - zero_cm - D).tolist()
        ),
    )


def _check(D: Array, x: Array) -> None:
    if len(D) != len(x) or len(D) < _MIN_ROWS:
        raise CalibrationError(
            f"{len(D)} distances are too few for a depth law; measure at least {_MIN_ROWS}, e.g. every 5 cm from 100 to 20 cm"
        )
    if not (np.all(np.isfinite(D)) and np.all(np.isfinite(x)) and D.min() > 0.0 and x.min() > 0.0):
        raise CalibrationError("every distance and disparity must be a positive number")
    if D.max() < _MIN_RANGE * D.min():
        raise CalibrationError(
            f"distances from {D.min():g} to {D.max():g} cm are too close together for a depth law; "
            f"the farthest must be {_MIN_RANGE:g} times the nearest"
        )
    if np.corrcoef(np.log(D), np.log(x))[0, 1] > -0.9:
        raise CalibrationError(
            "the disparities do not fall as the distances grow; are columns of the CSV swapped, "
            "or the left picture taken for the right one?"
        )


def _explain(D: Array, x: Array, product: float) -> tuple[float, float]:
    """offset (px) and zero (cm) of x = product / (D + zero) + offset, by Gauss-Newton on the
    disparities.
    """
    offset, zero = 0.0, 0.0
    # Almost linear: 20 rounds are far more than it takes.
    for _ in range(20):
        depth = np.maximum(D + zero, 1e-3)
        J = np.stack([np.ones_like(D), -product / depth**2], axis=1)
        step = np.linalg.lstsq(J, x - product / depth - offset, rcond=None)[0]
        offset, zero = offset + float(step[0]), zero + float(step[1])
    return offset, zero


def bench(
    distances_cm: Sequence[float] = SEED_DISTANCES_CM,
    *,
    focal_px: float = SEED_FOCAL_PX,
    baseline_cm: float = SEED_BASELINE_CM,
    divergence_rad: float = 0.0,
    zero_cm: float = 0.0,
    noise_px: float = 0.0,
    tape_cm: float = 0.0,
    seed: int = 1,
) -> tuple[Array, Array]:
    """The seed's bench: distances (n,) as read off the tape and the disparities (n,) px of a target
    on the rig's axis.

    Two cameras without distortion at +- B/2, each turned outwards by half of divergence_rad; the
    tape's zero lies zero_cm in front of the optical centres; noise_px is the sigma of a disparity,
    tape_cm that of placing the target.
    """
    generator = np.random.default_rng(seed)
    read = np.asarray(distances_cm, dtype=np.float64)
    true = read + zero_cm + generator.normal(0.0, 1.0, len(read)) * tape_cm
    angle = np.arctan(0.5 * baseline_cm / true) + 0.5 * divergence_rad
    return read, 2.0 * focal_px * np.tan(angle) + generator.normal(0.0, 1.0, len(read)) * noise_px


def depth_text(law: DepthLaw) -> str:
    """What `rhot calibrate depth` prints: the numbers for rig.toml, and the residuals of each law
    at each distance.
    """
    zero = f"the tape's zero {10.0 * law.zero_cm:.1f} mm in front of the optical centres"
    lines = [
        "  distance cm   disparity px   D = k x^z   D = k / x   geometry   (errors in cm)",
        *(
            f"  {D:>11.1f} {x:>14.2f} {a:>+11.2f} {b:>+11.2f} {c:>+10.2f}"
            for D, x, a, b, c in zip(
                law.distances_cm,
                law.disparities_px,
                law.power_cm,
                law.geometry_cm,
                law.explained_cm,
                strict=True,
            )
        ),
        f"  {'RMS':>11} {'':>14} {_rms(law.power_cm):>11.2f} {_rms(law.geometry_cm):>11.2f} {_rms(law.explained_cm):>10.2f}",
        f"  D = k x^z, RHOT eq. (9): k = {law.k:.1f}, z = {law.z:.4f} (the seed's rig: {SEED_K}, {SEED_Z})",
        f"  D = k / x, RHOT eq. (10): phi = {math.degrees(law.phi_rad):.3f} degrees",
        f"  geometry: cameras turned away from each other by {math.degrees(law.divergence_rad):.3f} degrees, {zero}",
        "Paste into rig.toml:",
        "[fusion.disparity]",
        f"k = {law.k:.1f}",
        f"z = {law.z:.4f}",
        f"phi_rad = {law.phi_rad:.5f}",
    ]
    return "\n".join(lines)


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))
