"""How true fusion is with cameras that are slow, or lose frames.

`python benchmarks/frame_rates.py [--tuning] [--json FILE]`

The motions of testing/families, points alone, 30 frames a second: all of them; each second and each
third, which rig.toml says; each third of a rig.toml that says 30; and a rig of which 60 % of the
frames fail to come, at random. In mm, geometric means over the motions of RMS, 95 % and maximum at
lags 0 and 2, and the largest of all; beside them the spline that knows the future, through the same
markers. Then the least share of points of what both cameras see (per cent), and the median over the
motions of squared error over variance (NEES).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from held_out_score import Figures, scores

from testing.families.case import Case, Half
from testing.families.catalog import cases
from testing.families.frame_rates import every, with_frames_lost

LAGS = (0, 2)
LOST, SEEDS = 0.6, 2
RATES: dict[str, Callable[[Case], list[Case]]] = {
    "30 a second": lambda case: [case],
    "15": lambda case: [every(case, 2, told=True)],
    "10": lambda case: [every(case, 3, told=True)],
    "10, 30 told": lambda case: [every(case, 3, told=False)],
    "30, 60 % lost": lambda case: [with_frames_lost(case, LOST, seed) for seed in range(SEEDS)],
}


def measure(half: Half) -> dict[str, dict[str, Figures]]:
    """Figures of every rate and motion."""
    found: dict[str, dict[str, Figures]] = {name: {} for name in RATES}
    for spec in cases(half, "points", "motion"):
        case = spec.build()
        for name, slowed in RATES.items():
            for number, one in enumerate(slowed(case)):
                found[name][f"{spec.name} {number}"] = scores(one, feedback=False, lags=LAGS)
        print(f"  {spec.name}", file=sys.stderr, flush=True)
    return found


def together(found: dict[str, Figures]) -> Figures:
    """One row: what the motions of a rate have together."""

    def mean(name: str) -> float:
        return float(np.exp(np.mean([np.log(one[name]) for one in found.values()])))

    row = {
        f"{kind}_{of}": mean(f"{kind}_{of}")
        for of in (*LAGS, "spline")
        for kind in ("rms", "p95", "max")
    }
    for lag in LAGS:
        row[f"largest_{lag}"] = max(one[f"max_{lag}"] for one in found.values())
        row[f"nees_{lag}"] = float(np.median([one[f"nees_{lag}"] for one in found.values()]))
    row["largest_spline"] = max(one["max_spline"] for one in found.values())
    row["share"] = min(one[f"share_{lag}"] for one in found.values() for lag in LAGS)
    return {name: round(value, 3) for name, value in row.items()}


def lines(rows: dict[str, Figures]) -> list[str]:
    """The table."""
    parts = [("lag 0", 0), ("lag 2", 2), ("spline", "spline")]
    head = f"{'':16}" + "".join(f"{name:>8}{'95 %':>7}{'max':>7}{'of all':>8}" for name, _ in parts)
    out = [f"{head}{'share':>8}{'NEES 0, 2':>12}"]
    for name, row in rows.items():
        cells = "".join(
            f"{row[f'rms_{of}']:8.2f}{row[f'p95_{of}']:7.2f}{row[f'max_{of}']:7.1f}"
            f"{row[f'largest_{of}']:8.0f}"
            for _, of in parts
        )
        nees = f"{row['nees_0']:.2f}, {row['nees_2']:.2f}"
        out.append(f"{name:16}{cells}{row['share']:8.1f}{nees:>12}")
    return out


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tuning", action="store_true", help="the half constants are chosen on")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    rows = {
        name: together(found)
        for name, found in measure("tuning" if options.tuning else "held_out").items()
    }
    print("TUNING HALF, not evidence" if options.tuning else "held-out half")
    print("\n".join(lines(rows)))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
