"""The joint filter of a hand beside a filter for each landmark, on the same markers.

`python benchmarks/joint.py [--tuning] [--family NAME] [--json FILE]`

Both methods of fusion run on every case of points of testing/families (the held-out half, or with
--tuning the other one), and beside them the non-causal spline of held_out.py. In mm: RMS at lags 0,
1 and 2 and the maximum at lag 2; the squared error over variance (NEES) at lag 2; the smallest
share of instants told; microseconds of processor time a camera frame; and the joint filter's RMS
over the other's. The last line has the medians of those ratios.
"""

from __future__ import annotations

import argparse
import functools
import json
import sys
import time
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from held_out_score import LAGS, Figures, scores

from services.fusion.step import FusionStep
from testing.families.case import Case, Half
from testing.families.catalog import FAMILIES, cases

Name = Literal["kalman", "joint"]
METHODS: tuple[Name, ...] = ("kalman", "joint")
# Frames left out of the timing, and the lag that it is taken at.
WARM_FRAMES, TIMED_LAG = 60, 1


def fusion_of(method: Name, case: Case, lag: int) -> FusionStep:
    """Fusion with the settings of the case, but for the method."""
    table = msgspec.structs.replace(case.config.fusion, lag_frames=lag, method=method)
    return FusionStep(msgspec.structs.replace(case.config, fusion=table), case.cameras, case.hands)


def cost_us(method: Name, case: Case) -> float:
    """Processor time of a camera frame, all of fusion included."""
    step = fusion_of(method, case, TIMED_LAG)
    for frame in case.frames[:WARM_FRAMES]:
        step.step(frame)
    begin_s = time.process_time()
    for frame in case.frames[WARM_FRAMES:]:
        step.step(frame)
    return 1e6 * (time.process_time() - begin_s) / max(len(case.frames) - WARM_FRAMES, 1)


def row(name: str, method: str, figures: Figures) -> str:
    """One line of the table."""
    rms = "".join(f"{figures[f'rms_{lag}']:8.2f}" for lag in LAGS)
    share = min(figures[f"share_{lag}"] for lag in LAGS)
    return (
        f"{name[:34]:35}{method:7}{rms}{figures['max_2']:9.1f}{figures['max_spline']:9.1f}"
        f"{figures['nees_2']:8.2f}{share:7.1f}{figures['us']:7.0f}"
    )


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--family", choices=FAMILIES, help="this one alone")
    parser.add_argument("--tuning", action="store_true", help="the half that constants are from")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half: Half = "tuning" if options.tuning else "held_out"
    print(f"{half}\n{'':42}   lag 0   lag 1   lag 2    max 2   spline    NEES  share     us")
    found: dict[str, dict[str, Figures]] = {}
    ratios: list[list[float]] = []
    for spec in cases(half, "points", options.family):
        case, name = spec.build(), f"{spec.family}: {spec.name}"
        found[name] = {}
        for method in METHODS:
            figures = scores(case, functools.partial(fusion_of, method), feedback=False)
            found[name][method] = figures | {"us": round(cost_us(method, case), 1)}
            print(row(name, method, found[name][method]), flush=True)
        joint, kalman = found[name]["joint"], found[name]["kalman"]
        ratios.append([joint[f"rms_{lag}"] / kalman[f"rms_{lag}"] for lag in LAGS])
        print(f"{'':35}{'ratio':7}" + "".join(f"{ratio:8.2f}" for ratio in ratios[-1]))
    print(f"{'median':35}{'ratio':7}" + "".join(f"{r:8.2f}" for r in np.median(ratios, axis=0)))
    if options.json:
        options.json.write_text(json.dumps({"half": half, **found}, indent=1) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
