"""How well lighthouses are registered to the rig: `python benchmarks/objects_registration.py`

A part of benchmarks/objects.py. 20 s of a painted tracker that is moved and turned, .3 px of noise
in two rolling-shutter cameras that run freely, 1 % of markers of other things, a tracker with 1 mm
and 0.2 deg of noise, 5 % of poses off by up to 250 mm and 0.5 rad, stamps late by 30 ms; two sizes
of volume, noise that is white or lasts .5 s (first-order Gauss-Markov). The error of a run is the
median over the volume. Beside it a plain method on the same data: nearest pose to each triangulated
point, rigid fit, neither lever arm nor time offset. Then what is wrong with the lateness of stamps,
by poses a second, of a hand that moves slowly. Last, a real Vive tracker against a laser tracker,
where $RHOT_DATA has it.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array, angle_between, apply, inverse, transform
from services.calibrator.objects.laser_points import read_experiment, register_laser
from services.calibrator.objects.points import register_points
from services.calibrator.objects.register import ObjectRegistration, register
from services.calibrator.objects.sightings import Sightings, sightings
from services.calibrator.objects.start import locate
from services.calibrator.objects.tracker_path import TrackerPath, tracker_path
from testing.synthetic_points import SyntheticRig
from testing.synthetic_tracker import COLOR, SERIAL, Lighthouse, TrackerMotion, painted_frames

DATA = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
LASER = DATA / "vive" / "marvin" / "20200827_Exp1"
SECONDS, SEEDS = 20.0, 20
VOLUMES: dict[str, dict[str, Any]] = {
    "0.3 m at 0.6 m": {"middle_m": (0.0375, 0.0, 0.6), "size_m": (0.30, 0.25, 0.30)},
    "0.7 m at 1.1 m": {"middle_m": (0.0375, 0.0, 1.1), "size_m": (0.70, 0.60, 0.60)},
}
NOISES = {"white": 0.0, "lasting .5 s": 0.5}
MARKER_M = 0.045
# Poses a second, as SteamVR is asked for them, and their white noise, of a hand that moves slowly.
RATES_HZ, RATE_NOISES_M, RATE_SEEDS = (60.0, 90.0, 120.0, 250.0), (1e-3, 3e-3), 6
SLOW_HZ = (0.1, 0.4)


@dataclass(frozen=True)
class Run:
    """Errors of one registration, and of the plain method; nan where it was refused."""

    mm: float
    worst_mm: float
    deg: float
    # By how much too late its stamps are thought to be.
    late_ms: float
    marker_mm: float
    # The error in units of the sigma that the result states: 1 if it is honest.
    sigmas: float
    plain_mm: float
    plain_deg: float
    seconds: float
    refused: str = ""


def run(seed: int, motion: TrackerMotion, lighthouse: Lighthouse) -> Run:
    """One recording, registered."""
    random = np.random.default_rng((seed, 23))
    direction = random.normal(size=3)
    marker_m = MARKER_M * direction / np.linalg.norm(direction)
    rig = SyntheticRig(sigma_px=0.3, seed=seed)
    frames = painted_frames(rig, motion, tuple(marker_m.tolist()), SECONDS)
    poses = lighthouse.poses(motion, SECONDS)
    begin_s = time.perf_counter()
    seen, path = sightings(frames, rig.rig(), COLOR), tracker_path(poses)
    T = lighthouse.T_rig_from_lighthouse()
    half = 0.5 * np.array(motion.size_m)
    volume_points = np.array(motion.middle_m) + random.uniform(-half, half, (500, 3))
    plain = _errors(_plain(seen, path), T, volume_points)
    try:
        found = register({SERIAL: seen}, {SERIAL: path})
    except CalibrationError as error:
        return Run(*[float("nan")] * 6, float(np.median(plain[0])), plain[1], 0.0, str(error))
    seconds = time.perf_counter() - begin_s
    mm, deg = _errors(found.T_rig_from_lighthouse, T, volume_points)
    place = found.trackers[SERIAL]
    return Run(
        mm=float(np.median(mm)),
        worst_mm=float(mm.max()),
        deg=deg,
        late_ms=1e-6 * place.time_offset_ns - 1e3 * lighthouse.late_s,
        marker_mm=1e3 * float(np.linalg.norm(place.marker_m - marker_m)),
        sigmas=_sigmas(found, T),
        plain_mm=float(np.median(plain[0])),
        plain_deg=plain[1],
        seconds=seconds,
    )


def _errors(found: Array, T: Array, points: Array) -> tuple[Array, float]:
    """Errors (n,) mm at points of the rig, and of the turn, deg."""
    off = apply(found, apply(inverse(T), points)) - points
    turn = np.degrees(angle_between(found[:3, :3], T[:3, :3]))
    return 1e3 * np.linalg.norm(off, axis=1), turn


def _sigmas(found: ObjectRegistration, T: Array) -> float:
    """RMS of the six errors about the middle, against the stated covariance."""
    turn = Rotation.from_matrix(found.T_rig_from_lighthouse[:3, :3] @ T[:3, :3].T).as_rotvec()
    inside = apply(inverse(found.T_rig_from_lighthouse), found.middle_m)
    error = np.concatenate([turn, found.middle_m - apply(T, inside)])
    return float(np.sqrt(error @ np.linalg.solve(found.covariance, error) / 6.0))


def _plain(seen: Sightings, path: TrackerPath) -> Array:
    """Triangulated paint against the tracker's own origin at its nearest stamp."""
    located = locate(seen)
    nearest = np.clip(np.searchsorted(path.stamps_ns, located.stamps_ns), 0, len(path) - 1)
    positions = path.positions_m[nearest]
    x0, p0 = located.points.mean(axis=0), positions.mean(axis=0)
    R = Rotation.align_vectors(located.points - x0, positions - p0)[0].as_matrix()
    return transform(R, x0 - R @ p0)


def measure(seeds: int = SEEDS) -> dict[str, Any]:
    """All runs; prints a table, and returns the figures."""
    runs = {
        (noise, volume): [
            run(
                seed,
                TrackerMotion(seed=seed, **VOLUMES[volume]),
                Lighthouse(seed=seed, correlation_s=NOISES[noise]),
            )
            for seed in range(1, seeds + 1)
        ]
        for noise in NOISES
        for volume in VOLUMES
    }
    head = ("mm (median, 95 %, max)", "deg", "ms", "marker mm", "sigmas", "plain mm", "deg", "s")
    print(f"{'noise':13s} {'volume':15s} {head[0]:>23s} {head[1]:>22s} {head[2]:>22s}", *head[3:])
    cases = []
    for (noise, volume), own in runs.items():
        case = {"noise": noise, "volume": volume} | _summary(own)
        cases.append(case)
        threes = (case[n] for n in ("registration_mm", "registration_deg", "time_offset_ms"))
        columns = ["  {:6.3f} {:6.3f} {:6.3f}".format(*three) for three in threes]
        rest = "{marker_mm:10.2f} {sigmas:6.2f} {plain_mm:8.1f} {plain_deg:4.2f} {seconds:4.1f}"
        print(f"{noise:13s} {volume:15s}", *columns, rest.format(**case), end="")
        print(f"  {case['refused']} refused" if case["refused"] else "")
    white = _summary([one for (noise, _), own in runs.items() if noise == "white" for one in own])
    figures: dict[str, Any] = {"registration_cases": cases}
    for name in ("registration_mm", "registration_deg", "time_offset_ms"):
        figures[name], figures[f"{name}_95"], figures[f"{name}_max"] = white[name]
    figures["registration_plain_mm"] = white["plain_mm"]
    figures["registration_refused"] = white["refused"]
    figures["by_rate"] = by_rate(min(seeds, RATE_SEEDS))
    return figures | (laser() if LASER.is_dir() else {})


def by_rate(seeds: int) -> dict[str, dict[str, list[float]]]:
    """How far off lateness is, ms: its mean and standard deviation, by rate and white noise."""
    found: dict[str, dict[str, list[float]]] = {}
    for rate_hz in RATES_HZ:
        own = found[f"{rate_hz:.0f} Hz"] = {}
        for noise_m in RATE_NOISES_M:
            late_ms = [
                run(
                    seed,
                    TrackerMotion(seed=seed, hz=SLOW_HZ, **VOLUMES["0.3 m at 0.6 m"]),
                    Lighthouse(seed=seed, rate_hz=rate_hz, noise_m=noise_m),
                ).late_ms
                for seed in range(1, seeds + 1)
            ]
            mean_and_sd = float(np.mean(late_ms)), float(np.std(late_ms))
            own[f"{1e3 * noise_m:.0f} mm"] = [round(value, 3) for value in mean_and_sd]
        told = "  ".join(f"{noise} {mean:6.2f} +- {sd:.2f}" for noise, (mean, sd) in own.items())
        print(f"{rate_hz:3.0f} poses a second, late by ms: {told}")
    return found


def laser() -> dict[str, float]:
    """A real tracker at the places of a laser tracker, mm: RMS, most, RMS of each place by the
    others, and RMS without a lever arm.
    """
    experiment = read_experiment(LASER)
    fit = register_laser(experiment)
    points, poses = experiment.points_m[experiment.again], experiment.poses
    left_out = []
    for k in range(len(points)):
        found = register_points(np.delete(points, k, axis=0), np.delete(poses, k, axis=0))
        paint = poses[k, :3, :3] @ found.marker_m + poses[k, :3, 3]
        left_out.append(apply(found.T_rig_from_lighthouse, paint) - points[k])
    unturned = poses.copy()
    unturned[:, :3, :3] = np.eye(3)
    figures = {
        "leica_rms_mm": 1e3 * fit.rms_m,
        "leica_max_mm": 1e3 * float(np.linalg.norm(fit.residuals_m, axis=1).max()),
        "leica_left_out_mm": 1e3 * float(np.sqrt(np.mean(np.sum(np.square(left_out), axis=1)))),
        "leica_no_lever_mm": 1e3 * register_points(points, unturned).rms_m,
    }
    print(*(f"{name} {value:.2f}" for name, value in figures.items()), sep="\n")
    return {name: round(value, 3) for name, value in figures.items()}


def _summary(runs: list[Run]) -> dict[str, Any]:
    """Medians, 95 % and maxima over runs that gave a result."""
    good = [one for one in runs if not one.refused]

    def three(name: str) -> list[float]:
        values = np.abs([getattr(one, name) for one in good])
        if not len(values):
            return [float("nan")] * 3
        return [round(float(v), 4) for v in (*np.quantile(values, (0.5, 0.95)), values.max())]

    return {
        "registration_mm": three("mm"),
        "worst_in_volume_mm": three("worst_mm"),
        "registration_deg": three("deg"),
        "time_offset_ms": three("late_ms"),
        "marker_mm": three("marker_mm")[0],
        "sigmas": three("sigmas")[0],
        "plain_mm": round(float(np.median([one.plain_mm for one in runs])), 2),
        "plain_deg": round(float(np.median([one.plain_deg for one in runs])), 3),
        "seconds": three("seconds")[0],
        "refused": len(runs) - len(good),
    }


def as_command(about: str, measured: Callable[[int], dict[str, Any]], seeds: int) -> int:
    """A benchmark of so many recordings of each kind, as a command: measure, print, and write."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--seeds", type=int, default=seeds, help="recordings of each kind")
    options = parser.parse_args()
    figures = measured(options.seeds)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(as_command(__doc__, measure, SEEDS))
