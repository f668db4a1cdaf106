"""What `rhot track` gains by what a running rig cannot have: later frames, and a second look.

    RHOT_DATA=FOLDER python benchmarks/hindsight.py [--tuning] [--part PART] [--json FILE]

Of hands that nobody measured, by the command's own steps: `live` (no lag, as `--as-live`), `later`
(two frames more, once over) and `track` (twice over, the second time with the size that the first
found: what the command does).

tips: the cases of held_out.py, rendered, through the real tracker. Points of landmarks that both
cameras see: RMS, 95 %, maximum (mm) and NEES; beside them the spline through each camera's markers,
which knows the future too.
postures: Leap recordings, wrist and tips exact, sizes guessed 12 and 5 % wrong and right. In the
first three seconds, the wrist's orientation and the last bones, degrees RMS; and how much larger or
smaller the hand becomes from the first pose to the last, per cent RMS.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
from held_out_score import Figures, figures_of, spline_figures, told_in
from unmeasured_posture import SIZES, WARM_S, Hand, errors_deg, recordings, solved

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.hand import default_hand
from rhot.messages import HandPoints
from services.cli.offline.pipeline import Output, Pipeline
from services.solver.step import SolverStep
from testing.families.case import Case, Half
from testing.families.catalog import cases

START_S = 3.0


def of_tips(half: Half) -> dict[str, Figures]:
    """By case."""
    found = {}
    for spec in cases(half, "pictures"):
        case, instants_s = spec.build(), np.empty(0)
        figures: Figures = {}
        for way, outputs in ways(case):
            told = told_in(points_of(outputs), case)
            of_way, instants_s = figures_of(case, told), told.instants_s
            figures |= {f"{key}_{way}": of_way[key] for key in ("rms", "p95", "max", "nees")}
        spline = spline_figures(case, instants_s)
        figures |= {f"{key}_spline": spline[key] for key in ("rms", "p95", "max")}
        found[f"{spec.family}: {spec.name}"] = rounded(figures)
    return found


def ways(case: Case) -> Iterator[tuple[str, list[Output]]]:
    """What comes out by each way."""
    later = msgspec.structs.replace(case.config.fusion, lag_frames=2)
    config = msgspec.structs.replace(case.config, fusion=later)
    yield "live", list(Pipeline(case.config, case.cameras).outputs(case.frames))
    pipeline = Pipeline(config, case.cameras)
    yield "later", list(pipeline.outputs(case.frames))
    yield "track", list(pipeline.again().outputs(case.frames))


def points_of(outputs: list[Output]) -> list[HandPoints]:
    """All points in order."""
    return [message for output in outputs for message in output.points]


def of_postures(folder: Path) -> dict[str, Figures]:
    """By recording."""
    found = {}
    for hand in recordings(folder):
        errors: dict[str, list[Array]] = {"live": [], "track": []}
        grown: dict[str, list[float]] = {"live": [], "track": []}
        for guess in SIZES:
            size = guess * hand.size
            for way in errors:
                off_deg, first, last = followed(hand, size)
                errors[way].append(off_deg)
                grown[way].append(last / first - 1.0)
                size *= last
        figures = {}
        for way, rows in errors.items():
            squares = np.concatenate(rows) ** 2
            figures[f"wrist_{way}"] = np.sqrt(squares[:, 0].mean())
            figures[f"last_bones_{way}"] = np.sqrt(squares[:, 1:].mean())
            figures[f"grown_{way}"] = 100.0 * np.sqrt(np.mean(np.square(grown[way])))
        found[hand.name] = rounded(figures)
    return found


def followed(hand: Hand, size: float) -> tuple[Array, float, float]:
    """Errors (m, 6) in the first seconds of a hand taken for that large, degrees, and how many
    times larger it is thought to be after the first pose and after the last.
    """
    step = SolverStep(RigConfig(), {hand.side: default_hand(hand.side, size)})
    sizes, rows = [], []
    for row in solved(hand, step):
        rows.append(row)
        sizes.append(step.size(hand.side) or 1.0)
    early = np.count_nonzero((hand.times_s >= WARM_S) & (hand.times_s < START_S))
    return errors_deg(hand, iter(rows[:early])), sizes[0], sizes[-1]


def rounded(figures: Figures) -> Figures:
    """As they are written."""
    return {name: round(float(value), 3) for name, value in figures.items()}


def means(rows: dict[str, Figures]) -> Figures:
    """Geometric means over the rows: what they have in common is a ratio."""
    logs = [[np.log(max(value, 1e-6)) for value in row.values()] for row in rows.values()]
    found = np.exp(np.mean(logs, axis=0)).tolist()
    return rounded(dict(zip(next(iter(rows.values())), found, strict=True)))


def main() -> None:
    """Print a row for each case and the geometric means, and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="tips: the half that is no evidence")
    parser.add_argument("--part", choices=("tips", "postures"), help="one part alone")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half: Half = "tuning" if options.tuning else "held_out"
    data = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    found: dict[str, dict[str, Figures]] = {}
    if options.part != "postures":
        found["tips"] = of_tips(half)
    if options.part != "tips":
        if not (data / "hand_motion").is_dir():
            raise SystemExit(f"no real recordings at {data}; set RHOT_DATA to their folder")
        found["postures"] = of_postures(data / "hand_motion")
    for part, rows in found.items():
        rows["geometric mean"] = means(rows)
        columns = list(rows["geometric mean"])
        print(f"\n{part + (f', {half} half' if part == 'tips' else ''):42}")
        print(f"{'':42}" + "".join(f"{column:>18}" for column in columns))
        for row, figures in rows.items():
            print(f"{row:42}" + "".join(f"{value:18.2f}" for value in figures.values()))
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
