"""What fusion learns of the cameras' clocks, and how sure it is. `python benchmarks/clocks.py`

Points of testing/families' motions, two free-running cameras at 30 fps, .06 px; [--tuning] for the
half that constants were chosen on, [--json FILE].

small: the tuner of clocks (services/fusion/monitors). Announced +-5 ms, truly `off`; from the third
second on: error RMS and largest (ms), the sigma it claims, NEES. Clean; under errors of 2 px that
last for some frames (AR(1), .7 from frame to frame and between neighbours); and with 2 s of wrong
static markers in one camera, from 4 s on (the error is that from 8 s on). Beside it a plain way on
the same clean heights: least squares over all rows, white noise.
gross: clocks that claim .1 ms and are off by -700 to 2000 ms (services/fusion/alignment): when each
is put right (s), and the error after that (ms). Beside it a plain way: the lag of the largest
correlation of the mean height, linearly interpolated.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from rhot.geometry.transforms import Array
from rhot.messages import MarkerFrame
from services.fusion.alignment.clock_alignment import ClockAlignment
from services.fusion.alignment.height_memory import HeightMemory
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.intake.observations import ObservationBuilder, View
from services.fusion.monitors.clock_offsets import ClockOffsetEstimator
from testing.families.catalog import cases
from testing.synthetic_points import START_NS, Motion, SyntheticRig, frames
from testing.wrong_markers import with_clock_error, with_correlated_errors, with_static_markers

SECONDS = 12.0
RIG = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4)
CAMERAS = RIG.rig()
PAIR = rectified_pairs(tuple(CAMERAS.values()))[0, 1]
OFFSETS_S = (-0.7, -0.02, 0.02, 0.137, 2.0)


def views(given: list[MarkerFrame]) -> list[View]:
    """Frames as fusion takes them in."""
    builder = ObservationBuilder(RIG.config(), CAMERAS)
    found = [builder.build(frame) for frame in given]
    return [view for view in found if isinstance(view, View)]


def tuned(given: list[MarkerFrame]) -> Array:
    """Time (s), the cameras' disagreement and its sigma (ms) after each frame: (n, 3)."""
    estimator = ClockOffsetEstimator(
        tuple(CAMERAS.values()), 6, np.full(2, 1.0 / RIG.fps), enabled=True
    )
    told = []
    for view in views(given):
        time_s = (view.instant_ns - START_NS) * 1e-9
        _, sigma_s = estimator.observe(view, time_s + view.delay_s)
        late_s = estimator.late_s
        apart_s = late_s["right"] - late_s["left"]
        told.append((time_s, 1e3 * apart_s, 1e3 * np.sqrt(2.0) * sigma_s))
    return np.array(told)


def least_squares_ms(given: list[MarkerFrame]) -> tuple[float, float]:
    """The plain way: shift and sigma from all heights at once, linearly interpolated, white."""
    memory = HeightMemory(2)
    for view in views(given):
        memory.add(view)
    heights, speeds = [], []
    for one, other in zip(*memory.tracks(0, 1, PAIR), strict=True):
        speed = np.gradient(one.heights, one.times_s)
        apart = one.heights - np.interp(one.times_s, other.times_s, other.heights)
        heights.append((apart - apart.mean())[3:-3])
        speeds.append((speed - speed.mean())[3:-3])
    h, v = np.concatenate(heights), np.concatenate(speeds)
    shift_s = float(h @ v / max(v @ v, 1e-12))
    left = float(np.mean((h - shift_s * v) ** 2))
    return 1e3 * shift_s, 1e3 * float(np.sqrt(left / max(v @ v, 1e-12)))


def correlation_ms(given: list[MarkerFrame]) -> float:
    """The plain way: the lag at which the mean heights correlate most, of +-2.5 s by 5 ms."""
    memory = HeightMemory(2)
    for view in views(given):
        memory.add(view)
    first, second = memory.tracks(0, 1, PAIR)
    mean = [
        np.mean([np.interp(at, t.times_s, t.heights) for t in own], axis=0)
        for own, at in ((first, first[0].times_s), (second, second[0].times_s))
    ]
    lags = np.arange(-2.5, 2.5, 0.005)
    found = []
    for lag in lags:
        at = first[0].times_s + lag
        inside = (at > second[0].times_s[0]) & (at < second[0].times_s[-1])
        there = np.interp(at[inside], second[0].times_s, mean[1])
        enough = np.count_nonzero(inside) > 45 and np.std(there) > 0.0
        found.append(np.corrcoef(mean[0][inside], there)[0, 1] if enough else -1.0)
    return 1e3 * float(lags[int(np.argmax(found))])


def small(motion: Motion) -> dict[str, float]:
    """The tuner's figures for one motion."""
    clean = frames(RIG, motion, SECONDS)
    found: dict[str, float] = {}
    for name, off_s, given in (
        ("clean", 0.002, clean),
        ("lasting", 0.0, with_correlated_errors(clean, 2.0)),
        ("wrong", 0.0, with_static_markers(clean, "right", (4.0, 6.0), frozen=False)),
    ):
        told = tuned(with_clock_error(given, "right", off_s, 5_000_000))
        told = told[told[:, 0] > (8.0 if name == "wrong" else 3.0)]
        error = told[:, 1] - 1e3 * off_s
        found[f"{name}_rms_ms"] = float(np.sqrt(np.mean(error**2)))
        found[f"{name}_max_ms"] = float(np.abs(error).max())
        found[f"{name}_sigma_ms"] = float(np.median(told[:, 2]))
        found[f"{name}_nees"] = float(np.mean((error / told[:, 2]) ** 2))
    shift_ms, sigma_ms = least_squares_ms(with_clock_error(clean, "right", 0.002))
    found["plain_error_ms"], found["plain_sigma_ms"] = abs(shift_ms - 2.0), sigma_ms
    return found


def gross(motion: Motion) -> dict[str, float]:
    """How many of the gross offsets are found, how soon and how well; and the plain way."""
    clean = frames(RIG, motion, SECONDS)
    after_s, errors_ms, plain_ms = [], [], []
    for off_s in OFFSETS_S:
        given = with_clock_error(clean, "right", off_s)
        alignment = ClockAlignment(tuple(CAMERAS.values()), enabled=True)
        for n, view in enumerate(views(given)):
            if alignment.observe(view):
                after_s.append(n / (2.0 * RIG.fps))
        found = alignment.corrections.values()
        errors_ms.extend(abs(1e3 * (one.late_s - off_s)) for one in found)
        plain_ms.append(abs(correlation_ms(given) - 1e3 * off_s))
    return {
        "found": float(len(errors_ms)),
        "after_s": max(after_s, default=float("nan")),
        "max_ms": max(errors_ms, default=float("nan")),
        "plain_max_ms": max(plain_ms),
    }


def main() -> int:
    """Run, print a table, and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the half constants were chosen on")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half = "tuning" if options.tuning else "held_out"
    results = {}
    print(
        f"{half}, ms    clean: rms max sigma NEES | plain sigma | lasting: rms max NEES | "
        "wrong: max | gross: found after max | plain"
    )
    for spec in cases(half, "points", "motion"):
        motion = spec.build().truth
        near, far = small(motion), gross(motion)
        results[spec.name] = near | {f"gross_{key}": value for key, value in far.items()}
        print(
            f"{spec.name:28s}{near['clean_rms_ms']:6.2f}{near['clean_max_ms']:6.2f}"
            f"{near['clean_sigma_ms']:6.2f}{near['clean_nees']:6.2f} |"
            f"{near['plain_error_ms']:6.2f}{near['plain_sigma_ms']:6.2f} |"
            f"{near['lasting_rms_ms']:6.2f}{near['lasting_max_ms']:6.2f}"
            f"{near['lasting_nees']:6.2f} |{near['wrong_max_ms']:6.2f} |"
            f"{far['found']:3.0f}/{len(OFFSETS_S)}{far['after_s']:6.1f}{far['max_ms']:6.2f} |"
            f"{far['plain_max_ms']:8.1f}",
            flush=True,
        )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
