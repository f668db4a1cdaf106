"""What a camera that tilted since its calibration costs, and what is left of it.

    RHOT_DATA=FOLDER python benchmarks/tilted_cameras.py [--tuning] [--json FILE]

The motions of testing/families, points alone, of two cameras of which one nods by so many degrees
more than its calibration says. In mm, over landmarks that both cameras see, from two seconds on:
RMS and maximum at lags 0 and 2; NEES (mean, lag 2). `as calibrated`: fusion, and the spline through
each camera's markers that knows the future.
"""

from __future__ import annotations

import dataclasses
import json
from unittest.mock import patch

import held_out_score
import numpy as np
from exposures import half_and_file
from held_out_score import figures_of, make_fusion, run, spline_figures
from one_camera import motions

from services.fusion.alignment.level_views import LevelViews
from testing.families.case import Case
from testing.families.points import point_case
from testing.synthetic_points import SyntheticRig

TILTS_DEG = (0.0, 0.05, 0.1, 0.2, -0.2, 0.3)
Figures = dict[str, float]


def fusion_figures(cases: list[Case]) -> Figures:
    """Over all cases: of squares and NEES the mean, of maxima the largest."""
    found: Figures = {}
    for lag in (0, 2):
        of = [figures_of(case, run(case, make_fusion(case, lag), feedback=False)) for case in cases]
        found[f"rms_{lag}"] = float(np.sqrt(np.mean([row["rms"] ** 2 for row in of])))
        found[f"max_{lag}"] = max(row["max"] for row in of)
    found["nees"] = float(np.mean([row["nees"] for row in of]))
    return {name: round(value, 3) for name, value in found.items()}


def spline_of(cases: list[Case]) -> Figures:
    """The same of the spline, each 33 ms."""
    of = [spline_figures(case, np.arange(2.0, case.seconds - 0.15, 1.0 / 30.0)) for case in cases]
    rms = float(np.sqrt(np.mean([row["rms"] ** 2 for row in of])))
    return {"rms": round(rms, 3), "max": round(max(row["max"] for row in of), 3)}


def main() -> None:
    """Print a row for each tilt, and write them."""
    half, file = half_and_file(__doc__)
    # By then heights are known.
    held_out_score.WARM_S = 2.0
    print(f"{half:12}{'rhot':40}{'as calibrated':40}spline")
    columns = ("rms_0", "max_0", "rms_2", "max_2", "nees")
    print(f"{'deg':8}" + 2 * "".join(f"{name:>8}" for name in columns) + f"{'rms':>8}{'max':>8}")
    table: dict[str, dict[str, Figures]] = {}
    for tilt_deg in TILTS_DEG:
        rig = dataclasses.replace(SyntheticRig(), tilt_rad=np.deg2rad(tilt_deg))
        cases = [point_case(name, motion, rig) for name, motion in motions(half).items()]
        row = {"rhot": fusion_figures(cases)}
        with patch.object(LevelViews, "take", lambda _self, _heights: None):
            row["calibrated"] = fusion_figures(cases)
        row["spline"] = spline_of(cases)
        table[f"{tilt_deg:g}"] = row
        values = [row[way][name] for way in ("rhot", "calibrated") for name in columns]
        values += row["spline"].values()
        print(f"{tilt_deg:<8g}" + "".join(f"{value:8.2f}" for value in values), flush=True)
    if file:
        file.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
