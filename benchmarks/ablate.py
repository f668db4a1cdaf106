"""What each correction buys on the held-out half: one of them off at a time.

`python benchmarks/ablate.py [--points | --pictures] [--family NAME] [--part NAME] [--tuning]
[--json FILE]`

Rows are parts of fusion and of the tracker (ablate_parts.py). Columns are what the cases say
without it: the geometric mean of RMS, 95 % and maximum over those with it (above 1: the part is
worth its place), the share of points, NEES (median over the cases), and how many cases reach every
target of held_out.py. Parts of the tracker are off in pictures only, each rendered once for all of
them; lags 0 and 2.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from ablate_parts import OF_PAINT, PARTS, TRACKERS, Part
from held_out_score import Figures, make_fusion, misses, scores

from rhot.files.rig_tables import Fusion
from testing.families.case import Case, CaseSpec, Half, Kind
from testing.families.catalog import FAMILIES, cases
from testing.families.marker_cache import kept
from testing.families.picture_catalog import recipes
from testing.families.pictures import detected

LAGS = (0, 2)


def figures_without(case: Case, part: Part) -> Figures:
    """A case's figures without a part of fusion, or with the markers it has."""
    table = dataclasses.replace(case, config=_with_settings(case, part))
    without = contextlib.nullcontext if part.tracker else part.without
    with without():
        # Points have no paint: no finger direction is told of them.
        is_paint = any(paint.extent_m for paint in case.hands[case.hand].paint.values())
        return scores(table, make_fusion, feedback=part.feedback and is_paint, lags=LAGS)


def _with_settings(case: Case, part: Part) -> Any:
    fusion: Fusion = msgspec.structs.replace(case.config.fusion, **part.settings)
    return msgspec.structs.replace(case.config, fusion=fusion)


def without_in_tracker(spec: CaseSpec, case: Case, name: str) -> Case:
    """A case of pictures with the markers of a tracker that lacks a part."""
    recipe = recipes(spec.half)[f"{spec.family}: {spec.name}"]
    found = kept(
        "ablated", recipe, lambda: detected(recipe, recipe.scene(), TRACKERS), tracker=True
    )
    return dataclasses.replace(case, frames=found[name])


def measure(specs: Sequence[CaseSpec], wanted: Sequence[str]) -> dict[str, dict[str, Figures]]:
    """Figures of every part and case; those of "" are with everything."""
    found: dict[str, dict[str, Figures]] = {name: {} for name in ("", *wanted)}
    for spec in specs:
        case, name = spec.build(), f"{spec.family}: {spec.name}"
        found[""][name] = figures_without(case, Part("everything"))
        for key in wanted:
            part = PARTS[key]
            used = without_in_tracker(spec, case, key) if part.tracker else case
            found[key][name] = figures_without(used, part)
        print(f"  {name}", file=sys.stderr, flush=True)
    return found


def summary(found: dict[str, dict[str, Figures]]) -> str:
    """The table."""
    head = f"{'without':20}" + "".join(
        f"{f'rms {lag}':>8}{f'95% {lag}':>8}{f'max {lag}':>8}{'share':>7}{'NEES':>7}"
        for lag in LAGS
    )
    lines = [head + f"{'reach':>8}   what is off"]
    whole = found[""]
    for key, by_case in found.items():
        cells = f"{key or '(nothing)':20}"
        for lag in LAGS:
            for kind in ("rms", "p95", "max"):
                ratios = [
                    max(by_case[name][f"{kind}_{lag}"], 1e-3)
                    / max(whole[name][f"{kind}_{lag}"], 1e-3)
                    for name in whole
                ]
                cells += f"{np.exp(np.nanmean(np.log(ratios))):8.3f}"
            cells += f"{min(f[f'share_{lag}'] for f in by_case.values()):7.1f}"
            cells += f"{np.nanmedian([f[f'nees_{lag}'] for f in by_case.values()]):7.2f}"
        reach = sum(not misses(figures, LAGS) for figures in by_case.values())
        about = PARTS[key].about if key else "with everything; ratios below are to this row"
        lines.append(f"{cells}{reach:5}/{len(by_case)}   {about}")
    return "\n".join(lines)


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--points", action="store_true", help="points alone")
    kinds.add_argument("--pictures", action="store_true", help="pictures alone")
    parser.add_argument("--family", choices=FAMILIES, help="this one alone")
    parser.add_argument("--tuning", action="store_true", help="the tuning half instead")
    parser.add_argument("--part", choices=PARTS, help="this part alone")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    options = parser.parse_args()
    half: Half = "tuning" if options.tuning else "held_out"
    wanted_kinds: list[Kind] = ["points"] if not options.pictures else []
    wanted_kinds += ["pictures"] if not options.points else []
    document: dict[str, Any] = {"half": half}
    for kind in wanted_kinds:
        of_kind = [
            name
            for name, part in PARTS.items()
            if options.part in (None, name)
            and (kind == "pictures" or not (part.tracker or name in OF_PAINT))
        ]
        specs = cases(half, kind, options.family)
        if not specs or not of_kind:
            continue
        found = measure(specs, of_kind)
        print(f"\n{kind}, {'TUNING HALF' if options.tuning else 'held-out half'}")
        print(summary(found), flush=True)
        document[kind] = found
    if options.json:
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
