"""How true fusion is on pictures of a renderer that shares nothing with the simulator.

    RHOT_DATA=FOLDER python benchmarks/other_renderer.py [--tuning] [--clip PART] [--drawn COUNT]
        [--json FILE]

VTK (`pip install 'rhot[other-renderer]'`) draws one smooth skin that recorded hands (a Leap
sensor's) bend, paint with ragged edges, lamps with shadows, a room; a Bayer sensor with shot noise,
JPEG, a rolling shutter and a lens that distorts take it (testing/second_renderer/). Colours are
fitted to clicks on paint (a clip whose clicks are refused is left out, and that is told); the
tracker, fusion and solver are the real ones, given a hand of the tables at a guessed size. The
truth is the middle of the paint on the bone's axis, and the skin under the wrist's dab. Rendering a
clip takes some minutes the first time.

Per clip, as held_out.py has it, over landmarks that both cameras see: RMS, 95 % and maximum (mm) at
lags 0, 1 and 2 and of the spline that knows the future, RMS over the spline's, the share of
instants with a point, NEES (mean and median), points within three sigmas; `fed` with the solver's
pose fed back, `alone` without. Then, of the same markers, what is left of a clock that is off by
20 and by 500 ms and says that it is right to .1 ms. `misses`: slow clips (to .8 m/s at most) more
than 10 mm off, fast ones more than 18; RMS above 2.2 and 1.15 times the spline's at lags 0 and 2;
presence below 98 %; a median of NEES outside .2 to 1.5; clocks 1.5 ms off or more. Beside the
spline: what centres of markers that are seen whole jump by from picture to picture, px, and how
many of them are on something else.
--tuning: the half that constants may be chosen on, which is no evidence. --drawn: so many clips
that a number draws (testing/second_renderer/catalog/drawn.py) instead of those made by hand.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from held_out_score import LAGS, Figures, make_fusion, run, scores

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from testing.families.case import UNHIDDEN_SHARE, Case, Half
from testing.synthetic_points import START_NS
from testing.wrong_markers import with_clock_error

if TYPE_CHECKING:
    from testing.second_renderer.clip import Clip

# Announced clock errors of the right camera, s.
OFFSETS_S = (0.02, 0.5)
_CLAIMED_NS = 100_000
_SLOW_M_S, _SLOW_MM, _FAST_MM = 0.8, 10.0, 18.0
_LAG_0, _LAG_2, _PRESENCE, _MEDIAN, _CLOCK_MS = 2.2, 1.15, 98.0, (0.2, 1.5), 1.5
# A marker so far from its paint is on something else: a tip is 12 to 25 px wide.
_ASTRAY_PX = 14.0
_WITHOUT_VTK = "VTK is not installed; pip install 'rhot[other-renderer]'"


def clock_left_ms(case: Case, offset_s: float) -> float:
    """What is left of a clock error that nobody announced, at the end of a clip; ms."""
    frames = with_clock_error(case.frames, "right", offset_s, _CLAIMED_NS)
    fusion = make_fusion(case, 0)
    run(dataclasses.replace(case, frames=frames), fusion, feedback=False)
    found = fusion.alignment.corrections.get("right")
    late_s, errors_s = fusion.clocks.late_s, case.clock_errors_s or {}
    apart_s = late_s["right"] - late_s["left"] + (found.late_s if found else 0.0)
    return 1e3 * (apart_s - offset_s - errors_s.get("right", 0.0))


def centre_errors_px(case: Case) -> list[Array]:
    """How far the centres of whole markers are off, (frames, landmarks, 2) of each camera, px.

    NaN where there is none, or something hides some of it.
    """
    landmarks = {case.config.hand[case.hand].markers[name]: name for name in case.landmarks}
    errors: list[Array] = []
    for camera in case.cameras.values():
        own = [n for n, frame in enumerate(case.frames) if frame.camera == camera.name]
        errors_px = np.full((len(own), len(landmarks), 2), np.nan)
        late_s = (case.clock_errors_s or {}).get(camera.name, 0.0)
        for row, n in enumerate(own):
            frame = case.frames[n]
            begin_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9 - late_s
            for marker in frame.markers:
                column = case.landmarks.index(landmarks[marker.color])
                if case.visible[n][column] >= UNHIDDEN_SHARE:
                    at_s = begin_s + marker.y_px * frame.row_time_ns * 1e-9
                    where = case.truth(np.array([at_s]))[0, column]
                    centre_px = np.array([marker.x_px, marker.y_px])
                    errors_px[row, column] = centre_px - camera.project(where).ravel()
        errors.append(errors_px)
    return errors


def jumps_px(errors_px: list[Array]) -> float:
    """What centres jump by from picture to picture, RMS of a coordinate, px.

    Second differences of their errors, over the square root of 6: those of white noise are itself.
    """
    seconds = [of[2:] - 2.0 * of[1:-1] + of[:-2] for of in errors_px]
    squares = [np.nanmean(of**2, axis=(0, 2)) / 6.0 for of in seconds]
    return float(np.sqrt(np.mean(squares)))


def astray(errors_px: list[Array]) -> int:
    """How many of them are on something else."""
    return sum(int(np.sum(np.linalg.norm(of, axis=2) > _ASTRAY_PX)) for of in errors_px)


def misses(fed: Figures, clocks_ms: list[float]) -> list[str]:
    """Which targets a clip misses, in a word each."""
    most_mm = _SLOW_MM if fed["speed"] <= _SLOW_M_S else _FAST_MM
    found = [f"max{lag}" for lag in LAGS if not fed[f"max_{lag}"] <= most_mm]
    for lag, most in ((0, _LAG_0), (2, _LAG_2)):
        if not fed[f"rms_{lag}"] <= most * fed["rms_spline"]:
            found.append(f"rms{lag}")
    if any(not fed[f"share_{lag}"] >= _PRESENCE for lag in LAGS):
        found.append("presence")
    if any(not _MEDIAN[0] <= fed[f"nees_median_{lag}"] <= _MEDIAN[1] for lag in LAGS):
        found.append("nees")
    if any(not abs(left) <= _CLOCK_MS for left in clocks_ms):
        found.append("clock")
    return found


def lines(name: str, found: Figures, kind: str) -> list[str]:
    """The rows of a clip."""
    return [
        f"{name[:24]:25}{kind:6}{lag:4}{found[f'rms_{lag}']:8.2f}{found[f'p95_{lag}']:7.2f}"
        f"{found[f'max_{lag}']:7.1f}{found[f'rms_{lag}'] / found['rms_spline']:8.2f}"
        f"{found[f'share_{lag}']:8.1f}{found[f'nees_{lag}']:7.2f}"
        f"{found[f'nees_median_{lag}']:6.2f}{found[f'within_{lag}']:8.2f}"
        for lag in LAGS
    ]


_HEAD = (
    f"{'clip':25}{'':6}{'lag':>4}{'rms':>8}{'95%':>7}{'max':>7}{'/spline':>8}{'share':>8}"
    f"{'NEES':>7}{'med':>6}{'within':>8}"
)


def measure(clips: Mapping[str, Clip]) -> dict[str, dict[str, Figures]]:
    """Figures of all clips, printed as they come."""
    from testing.second_renderer.clips import clip_case

    print(_HEAD)
    results: dict[str, dict[str, Figures]] = {}
    for name, clip in clips.items():
        try:
            case = clip_case(name, clip)
        except CalibrationError as error:
            print(f"{name:25}{error}", flush=True)
            continue
        fed, alone = scores(case, feedback=True), scores(case, feedback=False)
        clocks_ms = [clock_left_ms(case, offset_s) for offset_s in OFFSETS_S]
        left = dict(zip(("left_20ms", "left_500ms"), clocks_ms, strict=True))
        errors_px = centre_errors_px(case)
        markers = {"jumps_px": round(jumps_px(errors_px), 3), "astray": astray(errors_px)}
        results[name] = {"fed": fed, "alone": alone, "clocks": left, "markers": markers}
        for row in (*lines(name, fed, "fed"), *lines("", alone, "alone")):
            print(row)
        print(
            f"{'':25}spline  {fed['rms_spline']:10.2f}{fed['p95_spline']:7.2f}"
            f"{fed['max_spline']:7.1f}; {fed['speed']:.2f} m/s at most; markers jump by"
            f" {markers['jumps_px']:.2f} px, {markers['astray']} are astray; clocks are"
            f" {clocks_ms[0]:.2f} and {clocks_ms[1]:.2f} ms off; misses:"
            f" {' '.join(misses(fed, clocks_ms)) or 'none'}",
            flush=True,
        )
    return results


def chosen_clips(half: Half, part: str, count: int) -> dict[str, Clip]:
    """Clips of a half whose name has a part: those made by hand, or so many that are drawn."""
    from testing.second_renderer.catalog import CLIPS
    from testing.second_renderer.catalog.drawn import drawn

    clips = drawn(half, count) if count else CLIPS[half]
    return {name: clip for name, clip in clips.items() if part in name}


def main(
    measured: Callable[[Mapping[str, Clip]], Mapping[str, object]], description: str | None
) -> int:
    """Run, print, and write what is measured of the clips that are asked for."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tuning", action="store_true", help="the half constants are chosen on")
    parser.add_argument("--clip", default="", help="only clips whose name has this part")
    parser.add_argument("--drawn", type=int, default=0, help="so many clips drawn by number")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    if importlib.util.find_spec("vtkmodules") is None:
        print(_WITHOUT_VTK, file=sys.stderr)
        return 2
    half: Half = "tuning" if options.tuning else "held_out"
    print("TUNING HALF, not evidence" if options.tuning else "held-out half")
    found = measured(chosen_clips(half, options.clip, options.drawn))
    if options.json:
        options.json.write_text(json.dumps({"half": half, **found}, indent=1) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(measure, __doc__))
