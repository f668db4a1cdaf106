"""Bench measurements for the depth law: distances and disparities of a target, from a CSV file or
simulated. Pure but for reading the file.
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
from services.calibrator.depth_law.fit import PAPER_PAIR, StereoPair

# RHOT section 9.2: a target at 100 to 20 cm in steps of 5 cm.
PAPER_DISTANCES_CM = tuple(float(distance) for distance in range(100, 15, -5))
CSV_HEADER = ("distance_cm", "disparity_px")


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
        _parse_row(path, number, row)
        for number, row in enumerate(rows[1:], start=2)
        if any(cell.strip() for cell in row)
    ]
    table = np.array(values, dtype=np.float64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _parse_row(path: Path, number: int, row: list[str]) -> tuple[float, float]:
    where, given = f"{path}: line {number}", ",".join(row)
    try:
        distance, disparity = (float(cell) for cell in row)
    except ValueError:
        raise CalibrationError(
            f"{where}: expected two numbers, a distance and a disparity, got {given!r}"
        ) from None
    if not (
        math.isfinite(distance) and math.isfinite(disparity) and distance > 0.0 and disparity > 0.0
    ):
        raise CalibrationError(f"{where}: distance and disparity must be positive, got {given!r}")
    return distance, disparity


@dataclass(frozen=True)
class BenchErrors:
    """What is imperfect about a simulated bench."""

    # Angle between the optical axes; positive: the cameras look away from each other.
    divergence_rad: float = 0.0
    # How far the tape's zero lies in front of the optical centres.
    zero_cm: float = 0.0
    # Standard deviations of a disparity, and of placing the target.
    noise_px: float = 0.0
    tape_cm: float = 0.0


def simulate_bench(
    errors: BenchErrors | None = None,
    *,
    pair: StereoPair = PAPER_PAIR,
    distances_cm: Sequence[float] = PAPER_DISTANCES_CM,
    random_seed: int = 1,
) -> tuple[Array, Array]:
    """The paper's bench: distances (n,) cm as read off the tape, and disparities (n,) px.

    The target stands on the rig's axis, the cameras have no distortion, stand at +- B/2 and are
    each turned outwards by half of the divergence.
    """
    errors = errors or BenchErrors()
    random = np.random.default_rng(random_seed)
    read = np.asarray(distances_cm, dtype=np.float64)
    true = read + errors.zero_cm + random.normal(0.0, 1.0, len(read)) * errors.tape_cm
    angle = np.arctan(0.5 * pair.baseline_cm / true) + 0.5 * errors.divergence_rad
    noise = random.normal(0.0, 1.0, len(read)) * errors.noise_px
    return read, 2.0 * pair.focal_px * np.tan(angle) + noise
