"""What each correction buys on the held-out half: one of them off at a time.

`python benchmarks/ablate.py [--points | --pictures] [--family NAME] [--part NAME] [--tuning]
[--json FILE]`

Rows are parts of fusion and of the tracker. A part is taken out from here, by replacing it for the
run: the product has no switches for it. Columns are what the cases say without it: the geometric
mean of RMS, 95 % and maximum over those with it (above 1: the part is worth its place), the share
of points, NEES (median over the cases), and how many cases reach every target of held_out.py. Parts
of the tracker are off in pictures only, each rendered once for all of them; lags 0 and 2.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import msgspec
import numpy as np
from held_out_score import Figures, make_fusion, misses, scores

from rhot.files.rig_tables import Fusion
from rhot.geometry.transforms import Array
from services.fusion import step as fusion_step
from services.fusion.intake.observations import View
from services.fusion.kalman import hand_filter
from services.fusion.kalman.motion.motion_models import MotionModels
from services.fusion.output.systematic_error import SystematicError
from services.fusion.paint.hidden_paint import HiddenPaint
from services.fusion.paint.paint_to_bone import PaintToBone
from services.pi_tracker.identify import group_consistency
from services.pi_tracker.identify.background import BackgroundModel
from services.pi_tracker.identify.marker_identity import MarkerIdentity
from testing.families.case import Case, CaseSpec, Half, Kind
from testing.families.catalog import FAMILIES, cases
from testing.families.marker_cache import kept
from testing.families.picture_catalog import recipes
from testing.families.pictures import Without, detected

LAGS = (0, 2)
_OF_PAINT = (  # points have none of these
    "finger direction",
    "paint to bone",
    "hidden paint",
    "shape of paint",
    "surer directions",
    "systematic error",
)
_MODELS = hand_filter.MODELS


def _only(*rows: int) -> MotionModels:
    """Fusion's ladder of these rows."""
    return MotionModels(*(column[list(rows)] for column in _MODELS))


class _PaintAsItIs(PaintToBone):
    """Paint of no extent, of which nothing is known."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        # In place: kernels know where these are.
        for known in (self.known.radii_m, self.known.sags_m, self.known.areas_m2):
            known[:] = 0.0


class _AllShows(HiddenPaint):
    """Paint that nothing hides."""

    def observe(self, view: View, time_s: float) -> Array:  # noqa: ARG002 - as HiddenPaint's
        return np.zeros(len(view.landmarks))


def _told(name: str, value: float) -> type[HiddenPaint]:
    """Paint of which areas tell nothing: a column of KnownPaint stays at a value."""

    class Told(HiddenPaint):
        def observe(self, view: View, time_s: float) -> Array:
            found = super().observe(view, time_s)
            getattr(self.paint, name)[:] = value
            return found

    return Told


# Landmarks that have nothing in common but how lively they are.
_EACH_BY_ITSELF = _MODELS._replace(
    shift=np.zeros_like(_MODELS.shift),
    turn=np.zeros_like(_MODELS.turn),
    along=np.zeros_like(_MODELS.along),
    own=_MODELS.shift + _MODELS.own,
)


class Part(NamedTuple):
    """A part that can be off.

    without makes the context of a run; settings are of [fusion]; tracker: the markers are those of
    a tracker without it.
    """

    about: str
    without: Without = contextlib.nullcontext
    settings: dict[str, Any] = {}  # noqa: RUF012 - never written
    feedback: bool = True
    tracker: bool = False


def _replaced(*places: tuple[object, str, object]) -> Without:
    """Names of modules or classes (place, name, stand-in) replaced while the context lasts."""

    @contextlib.contextmanager
    def context() -> Iterator[None]:
        with contextlib.ExitStack() as stack:
            for place, name, stand_in in places:
                stack.enter_context(patch.object(place, name, stand_in))
            yield

    return context


PARTS: dict[str, Part] = {
    "rest": Part(
        "no model of a hand at rest",
        _replaced((hand_filter, "MODELS", _only(*range(1, len(_MODELS.own))))),
    ),
    "mixture of models": Part(
        "one model of motion instead of several, neither calm nor lively",
        _replaced((hand_filter, "MODELS", _only(3))),
    ),
    "liveliest model": Part(
        "the ladder ends before the model of sharp turns",
        _replaced((hand_filter, "MODELS", _only(*range(len(_MODELS.own) - 1)))),
    ),
    "way": Part(
        "no model knows which way the hand came",
        _replaced((hand_filter, "MODELS", _MODELS._replace(along=np.zeros_like(_MODELS.along)))),
    ),
    "shared motion": Part(
        "landmarks of a hand do not move together",
        _replaced((hand_filter, "MODELS", _EACH_BY_ITSELF)),
    ),
    "gate": Part("innovations are never refused", _replaced((hand_filter, "GATE", np.inf))),
    "clock tuning": Part("offsets stay as announced", settings={"tune_clocks": False}),
    "finger direction": Part("no poses come back from the solver", feedback=False),
    "paint to bone": Part(
        "the visible middle of paint is told as it is, its covariance too",
        _replaced((fusion_step, "PaintToBone", _PaintAsItIs)),
    ),
    "hidden paint": Part(
        "areas tell nothing of what hides a marker, nor of its shape",
        _replaced((fusion_step, "HiddenPaint", _AllShows)),
    ),
    "shape of paint": Part(
        "paint is as its model has it, sigma says",
        _replaced((fusion_step, "HiddenPaint", _told("shape_sds", 0.0))),
    ),
    "surer directions": Part(
        "directions are as unsure as poses tell, whatever areas say",
        _replaced((fusion_step, "HiddenPaint", _told("direction_shares", 1.0))),
    ),
    "systematic error": Part(
        "all of a marker's sigma is white noise",
        # Of points without extent nothing is systematic.
        _replaced(
            (fusion_step, "SystematicError", lambda e, c: SystematicError(np.zeros_like(e), c))
        ),
    ),
    "plausibility": Part(
        "points need not belong together",
        _replaced((fusion_step, "hand_reach_m", lambda _model: np.inf)),
    ),
    "background": Part(
        "tracker: static colours are not learned",
        _replaced((BackgroundModel, "foreground", lambda _self, _image, blobs, _noise: blobs)),
        tracker=True,
    ),
    "group": Part(
        "tracker: markers need not be near each other and alike in size",
        _replaced((group_consistency, "_pair_consistency", lambda _a, _b: 1.0)),
        tracker=True,
    ),
    "tracks and rims": Part(
        "tracker: any blob is as likely as another",
        _replaced((MarkerIdentity, "_prior", lambda *_: 1.0)),
        tracker=True,
    ),
}
_TRACKERS = {name: part.without for name, part in PARTS.items() if part.tracker}


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
        "ablated", recipe, lambda: detected(recipe, recipe.scene(), _TRACKERS), tracker=True
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
            and (kind == "pictures" or not (part.tracker or name in _OF_PAINT))
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
