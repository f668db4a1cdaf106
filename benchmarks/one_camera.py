"""How far off fusion tells what one camera sees alone, by how long the other has not seen it.

`python benchmarks/one_camera.py [--tuning] [--json FILE]`

The motions of testing/families, points alone, of which the second camera misses, every two seconds,
three finger tips for half a second, all six markers for .3 s, and all of them for a second. In mm,
at lag 0, over the landmarks that one camera sees alone: RMS and 95 % by the time since that camera
saw them last, how many of them are told (per cent), and the squared error over variance (NEES). A
point that fusion does not tell counts as missing, not as an error. Beside it, over the same points,
the plain method: the distance from the camera that it had when both saw it, along the true ray.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from held_out_score import make_fusion, run

from rhot.geometry.transforms import Array
from testing.families.case import Case, Half
from testing.families.motions import clapping, rolling, stop_and_go, tapping
from testing.families.points import Gaps, point_case
from testing.families.recordings import glove_motion, leap_motion
from testing.synthetic_points import Motion, MovingHand

BLIND = 1
ALL, THREE_TIPS = (0, 1, 2, 3, 4, 5), (2, 3, 4)
BEGIN_S, EVERY_S = 1.5, 2.0


class Pattern(NamedTuple):
    """What the second camera misses, and for how long."""

    landmarks: tuple[int, ...]
    seconds: float


PATTERNS = {
    "three tips, .5 s": Pattern(THREE_TIPS, 0.5),
    "all, .3 s": Pattern(ALL, 0.3),
    "all, 1 s": Pattern(ALL, 1.0),
}
EDGES_S = (0.0, 0.1, 0.2, 0.3, 0.5, 1.0)


def motions(half: Half) -> dict[str, Motion]:
    """The motions of a half, as testing/families/point_catalog.py divides them."""
    if half == "tuning":
        return {
            "sinusoids .5 m/s": MovingHand(seed=5),
            "leap grab": leap_motion("grab"),
            "glove, first 20 s": glove_motion(0, 2000),
            "stop and go 10 m/s2": stop_and_go(10.0, 1),
            "taps": tapping(4.0, 0.025, 1),
            "roll": rolling(0.4, 30.0, 1),
        }
    return {
        "sinusoids .8 m/s": MovingHand(speed_m_s=0.8, distance_m=0.9, seed=21),
        "leap splay": leap_motion("HandSplay-110fps"),
        "leap pinch": leap_motion("pinch"),
        "glove, last 30 s": glove_motion(3000, 6000),
        "stop and go 8 m/s2": stop_and_go(8.0, 11),
        "claps": clapping(1.2, 0.14, 11),
        "roll, splay, wait": rolling(0.65, 45.0, 11),
    }


class Errors(NamedTuple):
    """Of n points that one camera sees alone."""

    ages_s: Array  # (n,) since the other camera saw them
    ours_mm: Array  # (n,) NaN where not told
    plain_mm: Array  # (n,)
    squares: Array  # (n,) squared error over variance, NaN where not told


def errors(case: Case, pattern: Pattern) -> Errors:
    """Run fusion over a case with a gap."""
    told = run(case, make_fusion(case, 0), feedback=False)
    phase_s = (told.instants_s - BEGIN_S) % EVERY_S
    rows = np.flatnonzero((phase_s < pattern.seconds) & (told.instants_s >= BEGIN_S))
    columns = list(pattern.landmarks)
    off = (told.points_m - case.truth(told.instants_s))[rows][:, columns]
    covs = told.covariances_m2[rows][:, columns]
    given = np.isfinite(off[..., 0])
    squares = np.full(given.shape, np.nan)
    solved = np.linalg.solve(covs[given], off[given][..., None])[..., 0]
    squares[given] = np.einsum("ni,ni->n", off[given], solved) / 3.0
    last = case.truth(told.instants_s[rows] - phase_s[rows])[:, columns]
    now = case.truth(told.instants_s[rows])[:, columns]
    eye = next(iter(case.cameras.values())).centre_rig
    plain = np.linalg.norm(now - eye, axis=2) - np.linalg.norm(last - eye, axis=2)
    ages = np.broadcast_to(phase_s[rows, None], given.shape)
    known = np.isfinite(now[..., 0]) & np.isfinite(last[..., 0])
    return Errors(
        ages[known],
        1e3 * np.linalg.norm(off, axis=2)[known],
        1e3 * np.abs(plain)[known],
        squares[known],
    )


def figures(found: Errors) -> dict[str, float]:
    """Of all ages, and RMS by age."""
    told = np.isfinite(found.ours_mm)

    def rms(values: Array) -> float:
        return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")

    values = {
        "rms": rms(found.ours_mm[told]),
        "p95": float(np.percentile(found.ours_mm[told], 95.0)),
        "max": float(found.ours_mm[told].max()),
        "plain_rms": rms(found.plain_mm),
        "plain_p95": float(np.percentile(found.plain_mm, 95.0)),
        "share": 100.0 * float(told.mean()),
        "nees": float(found.squares[told].mean()),
        "nees_median": float(np.median(found.squares[told])),
    }
    for low, high in itertools.pairwise(EDGES_S):
        inside = (found.ages_s >= low) & (found.ages_s < high)
        values[f"rms_{high}"] = rms(found.ours_mm[told & inside])
        values[f"plain_{high}"] = rms(found.plain_mm[inside])
    return {name: round(value, 3) for name, value in values.items()}


def row(name: str, values: dict[str, float]) -> str:
    """One line of the table."""
    by_age = "".join(f"{values[f'rms_{high}']:7.1f}" for high in EDGES_S[1:])
    return (
        f"{name[:24]:25}{values['rms']:7.1f}{values['p95']:7.1f}{values['max']:7.1f}"
        f"{values['plain_rms']:7.1f}{values['plain_p95']:7.1f}{values['share']:7.1f}"
        f"{values['nees']:7.2f}{values['nees_median']:7.2f} {by_age}"
    )


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--tuning", action="store_true", help="the half that constants are from")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half: Half = "tuning" if options.tuning else "held_out"
    table: dict[str, dict[str, dict[str, float]]] = {}
    for title, pattern in PATTERNS.items():
        ends = "".join(f"{f'<{high} s':>7}" for high in EDGES_S[1:])
        print(
            f"\n{half}: {title:21}    rms    95%    max  plain    95%   told   NEES median {ends}"
        )
        gaps = Gaps(blind=((BLIND, pattern.landmarks, BEGIN_S, pattern.seconds),), every_s=EVERY_S)
        of_all = []
        table[title] = {}
        for name, motion in motions(half).items():
            found = errors(partial(point_case, name, motion, gaps=gaps)(), pattern)
            of_all.append(found)
            table[title][name] = figures(found)
            print(row(name, table[title][name]), flush=True)
        together = Errors(*(np.concatenate(parts) for parts in zip(*of_all, strict=True)))
        table[title]["all"] = figures(together)
        print(row("all of them", table[title]["all"]), flush=True)
    if options.json:
        options.json.write_text(json.dumps(table, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
