"""How true and honest points are just after a hand comes back into view.

    python benchmarks/returns.py [--tuning] [--json FILE]

The motions of testing/families (held-out half; --tuning: the one that constants may be chosen on),
points with .06 px of noise, two cameras at 30 fps; all markers of both are gone for .3 s in every
.9 s. Of landmarks that both cameras see, in the first .1 s and later, at lags of 0 and 2 frames:
RMS and the largest error (mm), NEES, per cent within three sigmas, and per cent of instants with a
point. Beside them, the plain way: rays of the two frames next in time meet.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path

import held_out_score
import msgspec
import numpy as np
from held_out_score import Figures, make_fusion, run

from rhot.geometry.transforms import Array
from services.fusion.step import FusionStep
from testing.families.case import Case, Half
from testing.families.catalog import cases
from testing.point_errors import THREE_SIGMAS, squared_distances
from testing.synthetic_points import START_NS

BEGIN_S, EVERY_S, GONE_S, EARLY_S = 1.0, 0.9, 0.3, 0.1


def with_returns(case: Case) -> Case:
    """The same with a hand that leaves the view and comes back."""
    frames, visible = [], case.visible.copy()
    for n, frame in enumerate(case.frames):
        at_s = 1e-9 * (frame.stamp_ns - frame.clock_offset_ns - START_NS)
        if at_s >= BEGIN_S and (at_s - BEGIN_S) % EVERY_S < GONE_S:
            frame, visible[n] = msgspec.structs.replace(frame, markers=[]), 0.0
        frames.append(frame)
    return dataclasses.replace(case, frames=frames, visible=visible)


def plainly(case: Case, _lag: int) -> FusionStep:
    """Views paired by the nearest frame, nothing filtered."""
    table = msgspec.structs.replace(
        case.config.fusion, method="triangulate", pairing="nearest", filter="none"
    )
    return FusionStep(msgspec.structs.replace(case.config, fusion=table), case.cameras, case.hands)


def since_s(times_s: Array) -> Array:
    """Seconds since the hand came into view last; negative: it is away."""
    away_s = (times_s - BEGIN_S) % EVERY_S - GONE_S
    return np.where(times_s < BEGIN_S, times_s, away_s)


def figures_of(case: Case) -> Figures:
    """Figures of a motion, by when and lag."""
    figures: Figures = {}
    for way, fusion_of, lag in (
        ("0", make_fusion, 0),
        ("2", make_fusion, 2),
        ("plain", plainly, 0),
    ):
        told = run(case, fusion_of(case, lag), feedback=False)
        errors = told.points_m - case.truth(told.instants_s)
        since, seen = since_s(told.instants_s), case.seen(told.instants_s)
        for when, low, high in (("early", 0.0, EARLY_S), ("later", EARLY_S, np.inf)):
            wanted = seen & ((since >= low) & (since < high))[:, None]
            given = wanted & np.isfinite(errors).all(axis=2)
            squares = squared_distances(errors[given], told.covariances_m2[given])
            lengths_mm = 1e3 * np.linalg.norm(errors[given], axis=1)
            found = {
                "rms": np.sqrt(np.mean(lengths_mm**2)),
                "max": lengths_mm.max(),
                "nees": squares.mean() / 3.0,
                "within": 100.0 * np.mean(squares <= THREE_SIGMAS),
                "share": 100.0 * given.sum() / wanted.sum(),
            }
            figures |= {f"{when}_{name}_{way}": float(value) for name, value in found.items()}
    return {name: round(value, 3) for name, value in figures.items()}


def means(rows: dict[str, Figures]) -> Figures:
    """Over the motions: of errors the geometric mean, else the mean."""
    found = {}
    for name in next(iter(rows.values())):
        values = np.array([row[name] for row in rows.values()])
        error = "_rms_" in name or "_max_" in name
        found[name] = float(np.exp(np.log(values).mean()) if error else values.mean())
    return {name: round(value, 3) for name, value in found.items()}


def main() -> None:
    """Print a row for each motion and their means, and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the half that is no evidence")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    # Starts are what is measured.
    held_out_score.WARM_S = 0.0
    half: Half = "tuning" if options.tuning else "held_out"
    rows = {
        spec.name: figures_of(with_returns(spec.build()))
        for spec in cases(half, "points", "motion")
    }
    rows["mean"] = means(rows)
    for when in ("early", "later"):
        columns = [name for name in rows["mean"] if name.startswith(when)]
        print(f"\n{when + ', ' + half + ' half':28}" + "".join(f"{c[6:]:>14}" for c in columns))
        for name, row in rows.items():
            print(f"{name:28}" + "".join(f"{row[column]:14.2f}" for column in columns))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
