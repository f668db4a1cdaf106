"""How true fusion is on what no constant was chosen on, beside a spline that knows the future.

`python benchmarks/held_out.py [--family NAME] [--points | --pictures] [--tuning] [--json FILE]`

Every family of testing/families has two halves. Constants may be chosen on the tuning half; this
reports the held-out half, and the other one only with --tuning, which says so in its title. The
halves differ in kind where they can:

    motion    tuning: Leap grab and wave, the glove's first 20 s, sinusoids at .5 m/s, stop and go
              at 10 and 14 m/s^2, slow flapping, taps, rolls. Held out: Leap splay and pinch, the
              glove's last 30 s, sinusoids at .8 m/s, stop and go at 8 and 20, flapping at .75 m/s
              RMS, claps, rolls and splays that wait, a resting hand of which one finger plays.
    noise     tuning: white, .03 and .2 px. Held out: .12 px with 6 % of frames lost; correlated.
    rig       tuning: 60 Hz, three cameras. Held out: turned in and wide at 25 Hz; 90 Hz triggered.
    gaps      tuning: 20 % missing; three tips hidden from one camera. Held out: 12 %; other tips,
              of cameras in turns; one camera gone for .3 s.
    clocks    offsets announced wrongly, by other amounts.

and of pictures, through the real tracker, solved with a hand of the tables at a guessed size:

    people      bones +-10 %, knuckles and thumb elsewhere. Tuning: adults. Held out: child, large.
    paint       tuning: 11 to 16 mm, dab 2 mm off. Held out: 8 to 10 and 17 to 20 mm, ragged, 5 mm.
    skin        tuning: tanned; held out: dark, pale.
    light       tuning: from the left, dim. Held out: warm from below with strong flicker; cold.
    processing  tuning: sharpened, JPEG 90. Held out: denoised and sharpened, JPEG 70, wrong range.
    room        coloured things behind. Tuning: a hand that plays; held out: a small one that waves.
    motion      tuning: Leap grab and wave, stop and go at 10 m/s^2, slow rolls. Held out: splay and
                pinch, 16 m/s^2, flapping, rolls that wait.

Rendering takes some minutes the first time, and none afterwards (testing/families/marker_cache.py).

Per case, over landmarks that all cameras see: RMS, median, 95 % and maximum (mm) at lags 0, 1 and
2, the share of instants with a point, the normalised estimation error squared (NEES, mean and
median, with the whole covariance), how many of the points told are within three sigmas (per cent,
with the whole covariance too: 99.7 of what is Gaussian), and the same errors of the non-causal
bound: a cubic spline through each camera's markers, triangulated. `misses` names the targets that a
case misses: tail2 (95 % or maximum above the spline's at lag 2), tail0 (above twice the spline's at
lag 0), share (below 99.5 %), nees (mean outside .5 to 2 at some lag), 30mm (a marker that is seen
whole told more than 30 mm off, though nothing moved faster than 1.5 m/s).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from held_out_score import LAGS, Figures, misses, scores

from testing.families.case import CaseSpec, Half, Kind
from testing.families.catalog import FAMILIES, cases

_HEAD = (
    f"{'':34}{'lag 0':^23}{'lag 1':^17}{'lag 2':^23}{'spline':^17}{'/ spline':^12}\n"
    f"{'case':34}{'rms':>6}{'95%':>7}{'max':>8}  {'rms':>6}{'max':>8}   "
    f"{'rms':>6}{'95%':>7}{'max':>8}  {'95%':>7}{'max':>8}  {'lag0':>6}{'lag2':>6}"
    f"{'share':>7}{'NEES 0,2 (median)':>24}{'within 3 sigmas 0,1,2':>24}  misses"
)


def row(name: str, f: Figures) -> str:
    """One line of the table; the ratios are of the 95 %."""
    ratio = {lag: f[f"p95_{lag}"] / f["p95_spline"] for lag in LAGS}
    share = min(f[f"share_{lag}"] for lag in LAGS)
    nees = (
        f"{f['nees_0']:8.2f}({f['nees_median_0']:.2f}){f['nees_2']:8.2f}({f['nees_median_2']:.2f})"
    )
    within = "".join(f"{f[f'within_{lag}']:8.2f}" for lag in LAGS)
    return (
        f"{name[:33]:34}{f['rms_0']:6.2f}{f['p95_0']:7.2f}{f['max_0']:8.1f}  "
        f"{f['rms_1']:6.2f}{f['max_1']:8.1f}   "
        f"{f['rms_2']:6.2f}{f['p95_2']:7.2f}{f['max_2']:8.1f}  "
        f"{f['p95_spline']:7.2f}{f['max_spline']:8.1f}  {ratio[0]:6.2f}{ratio[2]:6.2f}"
        f"{share:7.1f}{nees:>24}{within:>24}  {' '.join(misses(f)) or 'ok'}"
    )


def summary(found: dict[str, Figures]) -> str:
    """The medians over all cases, and the worst of each."""
    every = list(found.values())
    missed = [misses(figures) for figures in every]
    lines = [f"{missed.count([])} of {len(every)} cases reach every target"]
    lines += [
        f"  {word:6} missed by {sum(word in words for words in missed)}"
        for word in ("tail2", "tail0", "share", "nees", "30mm")
    ]
    for lag in LAGS:
        values = {
            kind: np.array([figures[f"{kind}_{lag}"] for figures in every])
            for kind in ("rms", "p95", "max", "nees", "share", "within")
        }
        lines.append(
            f"lag {lag}: rms median {np.median(values['rms']):.2f} mm, 95 % median"
            f" {np.median(values['p95']):.2f}, maximum median {np.median(values['max']):.1f},"
            f" largest {values['max'].max():.1f}; NEES {values['nees'].min():.2f} to"
            f" {values['nees'].max():.2f}; share at least {values['share'].min():.1f} %; within"
            f" 3 sigmas {_pooled(every, lag):.2f} % of all, at least {values['within'].min():.2f}"
        )
    return "\n".join(lines)


def _pooled(every: list[Figures], lag: int) -> float:
    """Of all cases' points that both cameras see, the share within three sigmas, per cent."""
    beyond = sum(figures[f"beyond_{lag}"] for figures in every)
    told = sum(figures[f"count_{lag}"] for figures in every)
    return 100.0 * (1.0 - beyond / told)


def by_family(found: dict[str, Figures]) -> dict[str, Figures]:
    """The worst of each family's cases, but for RMS and 95 %, of which it is the median."""
    families: dict[str, list[Figures]] = {}
    for name, figures in found.items():
        families.setdefault(name.split(":")[0], []).append(figures)
    result: dict[str, Figures] = {}
    for family, every in families.items():
        nees = [figures[f"nees_{lag}"] for figures in every for lag in LAGS]
        result[family] = {
            "cases": len(every),
            "reach": sum(not misses(figures) for figures in every),
            "share": min(figures[f"share_{lag}"] for figures in every for lag in LAGS),
            "within": min(figures[f"within_{lag}"] for figures in every for lag in LAGS),
            "nees_least": min(nees),
            "nees_most": max(nees),
        }
        for of in (*LAGS, "spline"):
            for kind, combine in (("rms", np.median), ("p95", np.median), ("max", max)):
                value = float(combine([figures[f"{kind}_{of}"] for figures in every]))
                result[family][f"{kind}_{of}"] = round(value, 3)
    return result


def measure(specs: Sequence[CaseSpec]) -> dict[str, Figures]:
    """Figures of every case, printed as they come."""
    print(_HEAD)
    found: dict[str, Figures] = {}
    for spec in specs:
        name = f"{spec.family}: {spec.name}"
        found[name] = scores(spec.build(), feedback=spec.kind == "pictures")
        print(row(name, found[name]), flush=True)
    return found


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--family", choices=FAMILIES, help="this one alone")
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--points", action="store_true", help="points alone: under a minute")
    kinds.add_argument("--pictures", action="store_true", help="pictures alone")
    parser.add_argument(
        "--tuning", action="store_true", help="the half that constants are chosen on instead"
    )
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half: Half = "tuning" if options.tuning else "held_out"
    wanted: list[Kind] = ["points"] if not options.pictures else []
    wanted += ["pictures"] if not options.points else []
    document: dict[str, Any] = {"half": half}
    for kind in wanted:
        specs = cases(half, kind, options.family)
        if not specs:
            continue
        title = "TUNING HALF, not evidence" if options.tuning else "held-out half"
        print(f"\n{kind}, {title}; errors in mm, NEES and misses: see --help")
        found = measure(specs)
        print(summary(found))
        document[kind] = {"families": by_family(found), "cases": found}
    if options.json:
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
