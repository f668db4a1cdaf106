"""Which filter is best for a noisy 3D marker? `python benchmarks/filters.py [--json FILE]`

RHOT section 10 chose the 1-Euro filter as better than Kalman, moving average and exponential
smoothing. Here each is tuned on a fair footing: the parameters with the smallest error in motion
among those that bring the jitter of a resting hand down to a given share. Noise of 1 mm is added to
synthetic and to real motion (Leap at 110 Hz, optical motion capture at 100 Hz; $RHOT_DATA, left out
if absent). Reported: error in motion (mm RMS in space), lag (ms: the shift at which the filtered
path fits best), and the jitter at rest.

Found: at equal rest, 1-Euro beats every filter with fixed gains, also a Kalman filter with a fixed
model; the paper was right in that. A Kalman filter that weighs several models, as fusion does, has
the least error and no lag.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.kalman.motion.motion_models import transition, unit_process_noise
from services.fusion.paired.one_euro import OneEuroFilter
from testing.synthetic_points import MovingHand

NOISE_M = 1e-3
# Correlation time of a hand's acceleration, as fusion's calm models have it.
ACCELERATION_TIME_S = 0.3
# Jitter at rest that each filter must reach, as a share of the noise.
TARGETS = (0.7, 0.5, 0.35)
# Covariance of one axis when a Kalman filter starts: position as measured, m/s, m/s^2.
START_COV = np.diag([NOISE_M**2, 0.25, 25.0])


def one_euro(path: Array, rate_hz: float, mincutoff_hz: float, beta: float) -> Array:
    """Casiez 2012, one cutoff for all axes."""
    own = OneEuroFilter(mincutoff_hz, beta, 1.0, joint=True)
    return np.array([own(point, 1.0 / rate_hz) for point in path])


# All filters are called alike.
def moving_average(path: Array, rate_hz: float, samples: float) -> Array:  # noqa: ARG001
    """Mean of the last samples."""
    n = int(samples)
    padded = np.concatenate([np.repeat(path[:1], n - 1, axis=0), path])
    return np.stack(
        [np.convolve(padded[:, k], np.full(n, 1.0 / n), mode="valid") for k in range(3)], axis=1
    )


def exponential(path: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """First-order low pass with a fixed cutoff."""
    return one_euro(path, rate_hz, cutoff_hz, 0.0)


def double_exponential(
    path: Array,
    rate_hz: float,  # noqa: ARG001
    alpha: float,
    trend: float,
) -> Array:
    """Holt's: level and trend."""
    level, slope, out = path[0], np.zeros(3), [path[0]]
    for point in path[1:]:
        before = level
        level = alpha * point + (1.0 - alpha) * (level + slope)
        slope = trend * (level - before) + (1.0 - trend) * slope
        out.append(level)
    return np.array(out)


def kalman(path: Array, rate_hz: float, density: float) -> Array:
    """Fusion's motion model with one jerk density; positions are measured.

    services/fusion/kalman/motion/motion_models.py. The gain is the same for all axes.
    """
    F, unit_Q = motion_model(rate_hz)
    state = np.zeros((3, 3))  # position, velocity, acceleration; each of the three axes
    state[0] = path[0]
    P = START_COV
    filtered = [path[0]]
    for point in path[1:]:
        state = F @ state
        P = F @ P @ F.T + density * unit_Q
        innovation = point - state[0]
        gain = P[:, 0] / (P[0, 0] + NOISE_M**2)
        state = state + np.outer(gain, innovation)
        P = P - np.outer(gain, P[0])
        filtered.append(state[0])
    return np.array(filtered)


def motion_model(rate_hz: float) -> tuple[Array, Array]:
    """F (3, 3) and the process noise (3, 3) of one axis for a jerk density of 1."""
    rates, dt_s = (0.0, 1.0 / ACCELERATION_TIME_S), 1.0 / rate_hz
    f01, f02, f11, f12, f21, f22 = transition(*rates, dt_s)
    Q = np.empty((3, 3))
    unit_process_noise(rates, dt_s, Q)
    return np.array([[1.0, f01, f02], [0.0, f11, f12], [0.0, f21, f22]]), Q


def adaptive_kalman(path: Array, rate_hz: float, calmest: float) -> Array:
    """Four of these side by side, weighted by their likelihoods; densities from `calmest` to 5000.

    As in services/fusion/kalman/filtering.py.
    """
    densities = np.geomspace(calmest, 5000.0, 4)
    F, unit_Q = motion_model(rate_hz)
    states = np.zeros((4, 3, 3))
    states[:, 0] = path[0]
    covs = np.tile(START_COV, (4, 1, 1))
    probability = np.full(4, 0.25)
    filtered = [path[0]]
    for point in path[1:]:
        states = F @ states
        covs = F @ covs @ F.T + densities[:, None, None] * unit_Q
        innovations = point - states[:, 0]  # (4, 3)
        variances = covs[:, 0, 0] + NOISE_M**2  # (4,)
        gains = covs[:, :, 0] / variances[:, None]  # (4, 3)
        states = states + gains[:, :, None] * innovations[:, None, :]
        covs = covs - gains[:, :, None] * covs[:, None, 0]
        log = -0.5 * np.sum(innovations**2, axis=1) / variances - 1.5 * np.log(variances)
        probability = (0.997 * probability + 0.003 / 4) * np.exp(log - log.max())
        probability /= probability.sum()
        filtered.append(probability @ states[:, 0])
    return np.array(filtered)


def unfiltered(path: Array, rate_hz: float) -> Array:  # noqa: ARG001
    """As it comes."""
    return path


CANDIDATES: dict[str, tuple[Callable[..., Array], list[tuple[float, ...]]]] = {
    "none": (unfiltered, [()]),
    "one_euro": (
        one_euro,
        list(product(np.geomspace(0.2, 20.0, 14).tolist(), np.geomspace(3.0, 3000.0, 13).tolist())),
    ),
    "kalman": (kalman, [(density,) for density in np.geomspace(1e-3, 1e4, 29).tolist()]),
    "adaptive_kalman": (
        adaptive_kalman,
        [(density,) for density in np.geomspace(1e-5, 10.0, 13).tolist()],
    ),
    "moving_average": (moving_average, [(float(n),) for n in range(1, 33)]),
    "exponential": (exponential, [(cutoff,) for cutoff in np.geomspace(0.2, 30.0, 29).tolist()]),
    "double_exponential": (
        double_exponential,
        list(product(np.linspace(0.1, 0.95, 12).tolist(), np.linspace(0.02, 0.8, 10).tolist())),
    ),
}


@dataclass(frozen=True, eq=False)
class Motion:
    """A path without noise (n, 3) in metres at an even rate."""

    name: str
    rate_hz: float
    path: Array


def motions(data: Path) -> Iterator[Motion]:
    """Synthetic ones, and the real ones that are there."""
    for rate_hz, speed in ((30.0, 0.5), (60.0, 0.5), (30.0, 0.15)):
        instants = np.arange(0.0, 12.0, 1.0 / rate_hz)
        yield Motion(
            f"synthetic {speed} m/s {rate_hz:.0f} Hz",
            rate_hz,
            MovingHand(speed_m_s=speed)(instants)[:, 2],
        )
    for name in ("grab", "pinch", "wave"):
        file = data / "leap" / f"{name}.csv"
        if file.exists():
            with file.open() as lines:
                rows = list(csv.DictReader(lines))
            yield Motion(
                f"leap {name} 110 Hz",
                110.0,
                1e-3
                * np.array([[float(row[f"index_tip_{axis}"]) for axis in "xyz"] for row in rows]),
            )
    file = data / "qualisys" / "recording.tsv.gz"
    if file.exists():
        with gzip.open(file, "rt", encoding="utf-8") as lines:
            table = [line.rstrip("\n").split("\t") for line in lines]
        header = next(row for row in table if row[0] == "Frame")
        column = header.index("index_tip X")
        rows = [row for row in table[table.index(header) + 1 :] if len(row) > column + 2]
        path = 1e-3 * np.array(
            [[float(cell or 0.0) for cell in row[column : column + 3]] for row in rows[1500:3000]]
        )
        yield Motion("qualisys 100 Hz", 100.0, path)


def lag_ms(filtered: Array, motion: Motion) -> float:
    """The delay (0-200 ms) at which the filtered path fits the true one best."""
    instants = np.arange(len(motion.path)) / motion.rate_hz
    inside = instants >= 0.3
    delays = np.arange(0.0, 0.2, 0.002)
    errors = []
    for delay_s in delays:
        shifted = np.stack(
            [np.interp(instants - delay_s, instants, motion.path[:, k]) for k in range(3)], axis=1
        )
        errors.append(float(np.mean((filtered - shifted)[inside] ** 2)))
    return 1e3 * float(delays[int(np.argmin(errors))])


def compare(motion: Motion, every: int = 1) -> dict[str, Any]:
    """Every filter at its best for each target of jitter; of its candidates every so many."""
    random = np.random.default_rng(0)
    noisy = motion.path + random.normal(0.0, NOISE_M, motion.path.shape)
    rest = random.normal(0.0, NOISE_M, (600, 3))
    settled = int(0.3 * motion.rate_hz)
    found: dict[str, Any] = {}
    for name, (own, candidates) in CANDIDATES.items():
        tried = []
        for values in candidates[::every]:
            filtered = own(noisy, motion.rate_hz, *values)
            error = 1e3 * float(
                np.sqrt(np.mean(np.sum((filtered - motion.path)[settled:] ** 2, axis=1)))
            )
            tried.append(
                (float(own(rest, motion.rate_hz, *values)[200:].std()) / NOISE_M, error, values)
            )
        for target in TARGETS if name != "none" else (1.0,):
            allowed = [entry for entry in tried if entry[0] <= target * 1.05]
            if not allowed:
                continue
            jitter, error, values = min(allowed, key=lambda entry: entry[1])
            entry = {
                "jitter": round(jitter, 2),
                "error_mm": round(error, 2),
                "values": [round(value, 3) for value in values],
            }
            entry["lag_ms"] = round(lag_ms(own(noisy, motion.rate_hz, *values), motion), 1)
            found.setdefault(str(target), {})[name] = entry
    return found


def main() -> int:
    """Run, print a table, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="every third candidate: not for figures",
    )
    options = parser.parse_args()
    data = (
        Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
        / "hand_motion"
    )
    results = {}
    for motion in motions(data):
        results[motion.name] = compare(motion, 3 if options.quick else 1)
        print(f"\n{motion.name}: noise {1e3 * NOISE_M:.0f} mm on each axis")
        for target, filters in results[motion.name].items():
            for name, entry in filters.items():
                print(
                    f"  jitter <= {target}: {name:18s} error {entry['error_mm']:6.2f} mm  "
                    f"lag {entry['lag_ms']:5.1f} ms  jitter {entry['jitter']:.2f}  "
                    f"{entry['values']}"
                )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
