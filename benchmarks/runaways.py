"""How often fusion tells a landmark far off and does not know it, where cameras miss markers.

`python benchmarks/runaways.py [--tuning] [--seeds 8] [--json FILE]`

The motions of benchmarks/one_camera.py, points alone, of which either camera misses some landmarks
for .07 to 1 s, four times in every two seconds, and up to a fifth of all markers besides. Counted
at lag 0: instants and landmarks told more than 50 mm off and by more than six of their sigmas;
cases with any; the largest error of those (mm), and of all that is told.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from held_out_score import make_fusion, run
from one_camera import motions

from testing.families.case import Case, Half
from testing.families.points import Gaps, point_case
from testing.point_errors import squared_distances
from testing.synthetic_points import Motion

FAR_MM, SIGMAS = 50.0, 6.0
LENGTHS_S, SHARES = (0.07, 0.15, 0.3, 0.6, 1.0), (0.0, 0.05, 0.2)


class Found(NamedTuple):
    """Of one case."""

    told: int
    astray: int
    astray_mm: float
    largest_mm: float


def case_of(name: str, motion: Motion, seed: int) -> Case:
    """A motion with gaps."""
    random = np.random.default_rng([seed, 77])
    blind = []
    for _ in range(4):
        missed = random.choice(6, size=int(random.integers(1, 7)), replace=False)
        camera, begin_s = int(random.integers(0, 2)), float(random.uniform(1.0, 3.0))
        blind.append((camera, tuple(sorted(missed.tolist())), begin_s, random.choice(LENGTHS_S)))
    share = float(random.choice(SHARES))
    return point_case(name, motion, gaps=Gaps(share=share, blind=tuple(blind), seed=seed))


def found(case: Case) -> Found:
    """What fusion tells of a case."""
    told = run(case, make_fusion(case, 0), feedback=False)
    off = told.points_m - case.truth(told.instants_s)
    lengths_mm = 1e3 * np.linalg.norm(off, axis=2)
    known = np.isfinite(lengths_mm)
    squares = squared_distances(off[known], told.covariances_m2[known])
    errors_mm = lengths_mm[known]
    astray = errors_mm[(errors_mm > FAR_MM) & (squares > SIGMAS**2)]
    return Found(
        len(errors_mm), len(astray), float(astray.max(initial=0.0)), float(errors_mm.max())
    )


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--tuning", action="store_true", help="the half that constants are from")
    parser.add_argument("--seeds", type=int, default=8, help="of each motion")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half: Half = "tuning" if options.tuning else "held_out"
    print(f"{half:26}{'told':>8}{'astray':>8}{'cases':>7}{'astray mm':>11}{'largest mm':>12}")
    table: dict[str, dict[str, float]] = {}
    of_all: list[Found] = []
    for name, motion in motions(half).items():
        these = [found(case_of(name, motion, seed)) for seed in range(options.seeds)]
        of_all += these
        table[name] = row(name, these)
    table["all"] = row("all of them", of_all)
    if options.json:
        options.json.write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")
    return 0


def row(name: str, these: list[Found]) -> dict[str, float]:
    """Figures of some cases, printed."""
    figures = {
        "told": float(sum(one.told for one in these)),
        "astray": float(sum(one.astray for one in these)),
        "cases": float(sum(one.astray > 0 for one in these)),
        "astray_mm": round(max(one.astray_mm for one in these), 1),
        "largest_mm": round(max(one.largest_mm for one in these), 1),
    }
    told, astray, cases, astray_mm, largest_mm = figures.values()
    print(f"{name[:24]:26}{told:8.0f}{astray:8.0f}{cases:7.0f}{astray_mm:11.0f}{largest_mm:12.0f}")
    sys.stdout.flush()
    return figures


if __name__ == "__main__":
    sys.exit(main())
