"""How exact fusion is, how consistent its sigmas are, and what it costs.

`python benchmarks/accuracy.py [--synthetic-only] [--json FILE]`

The figures at the top are from pictures: hands as the simulator's cameras see them (sensor noise of
5 grey levels), through the tracker and fusion, with the solver's finger directions fed back,
against the landmarks of the truth; four random seeds each. Those under `synthetic` are from points
(testing/synthetic_points.py) with 0.06 px of white noise: fusion's own errors. In mm; *_rms_mm is
about the truth, *_precision_mm about each landmark's own mean, *_bias_mm that mean's. nees is the
normalised estimation error squared, squared error over predicted variance: 1 if sigma is right.
*_over_crb is the precision against the Cramer-Rao bound of one frame of each camera at the
detector's measured noise.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from accuracy_pictures import RENDERED_SEEDS, Pictures
from accuracy_points import OTHERS, depth_bound_mm, synthetic_figures

from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import Fusion, HandTable
from rhot.messages import MarkerFrame
from services.fusion.step import FusionStep
from testing.synthetic_points import MovingHand, SyntheticRig, frames, point_hands

# Frames left out of the timing.
WARM_FRAMES = 100
# Landmarks and colours beyond the six of a synthetic hand.
KNUCKLES = {"index_proximal": "yellow", "middle_proximal": "orange"}


def cost(cameras: int = 2, fps: float = 30.0, markers: int = 6) -> dict[str, float]:
    """Microseconds of one frame, with and without output of points, and the share of a core."""
    setup = SyntheticRig(cameras=cameras, fps=fps, phase_s=1.0 / (fps * cameras))
    more = KNUCKLES if markers > 6 else {}
    given = [_with_knuckles(frame, more) for frame in frames(setup, MovingHand(), 8.0)]
    config = setup.config()
    config = msgspec.structs.replace(
        config, hand={"right": HandTable(markers=config.hand["right"].markers | more)}
    )
    step = FusionStep(config, setup.rig(), point_hands())
    without_output: list[float] = []
    with_output: list[float] = []
    for number, frame in enumerate(given):
        begin_s = time.perf_counter()
        messages = step.step(frame)
        took_s = time.perf_counter() - begin_s
        # Compiling, or loading what was compiled, is over by then.
        if number >= WARM_FRAMES:
            (with_output if messages else without_output).append(took_s)
    total_s = sum(without_output) + sum(with_output)
    share = total_s / (8.0 * (len(given) - WARM_FRAMES) / len(given))
    return {
        "update_us": round(1e6 * float(np.median(without_output)), 1),
        "update_and_tell_us": round(1e6 * float(np.median(with_output)), 1),
        "core_percent": round(100.0 * share, 1),
    }


def _with_knuckles(frame: MarkerFrame, knuckles: dict[str, str]) -> MarkerFrame:
    """A frame with further markers: knuckles that move as the first ones do, some pixels off."""
    more = [
        msgspec.structs.replace(marker, color=color, y_px=marker.y_px + 12.0)
        for marker, color in zip(frame.markers, knuckles.values(), strict=False)
    ]
    return msgspec.structs.replace(frame, markers=frame.markers + more)


def still_figures(scenes: list[Pictures]) -> dict[str, Any]:
    """Depth of a still hand: about the truth, about its own mean, against the bound; NEES."""
    scores = {str(scene.distance_m): scene.score(Fusion()) for scene in scenes}
    noise = {str(scene.distance_m): scene.detector_noise_px() for scene in scenes}
    precision = {distance: score.precision_z_mm() for distance, score in scores.items()}
    bound = {
        distance: depth_bound_mm(float(distance), noise_px) for distance, noise_px in noise.items()
    }
    return {
        "still_depth_rms_mm": {
            distance: score.figures()["z"] for distance, score in scores.items()
        },
        "still_depth_precision_mm": {
            distance: round(value, 3) for distance, value in precision.items()
        },
        "still_depth_bias_mm": {
            distance: round(score.bias_z_mm(), 3) for distance, score in scores.items()
        },
        "still_detector_noise_px": {distance: round(value, 4) for distance, value in noise.items()},
        "still_crb_mm": {distance: round(value, 3) for distance, value in bound.items()},
        "still_over_crb": {
            distance: round(precision[distance] / bound[distance], 3) for distance in scores
        },
        "still_rms_over_crb": {
            distance: round(score.figures()["z"] / bound[distance], 3)
            for distance, score in scores.items()
        },
        "still_nees": {distance: score.figures()["nees"] for distance, score in scores.items()},
        "still_nees_depth": {
            distance: score.figures()["nees_z"] for distance, score in scores.items()
        },
        "still_with_finger_direction": {
            distance: score.figures() for distance, score in scores.items()
        },
        "still_without_finger_direction": {
            str(scene.distance_m): scene.score(Fusion(), feedback=False).figures()
            for scene in scenes
        },
    }


def moving_figures(scene: Pictures) -> dict[str, Any]:
    """A moving hand by lag, and by the other methods."""
    lags = {str(lag): scene.score(Fusion(lag_frames=lag)).figures() for lag in (0, 1, 2)}
    plain = {
        str(lag): scene.score(Fusion(lag_frames=lag), feedback=False).figures() for lag in (0, 1, 2)
    }
    return {
        "moving_rms_mm": {lag: figures["rms"] for lag, figures in lags.items()},
        "moving_nees": {lag: figures["nees"] for lag, figures in lags.items()},
        "moving_nees_depth": {lag: figures["nees_z"] for lag, figures in lags.items()},
        "moving_without_finger_direction_rms_mm": {
            lag: figures["rms"] for lag, figures in plain.items()
        },
        "moving_other_methods_rms_mm": {
            name: scene.score(fusion).figures()["rms"] for name, fusion in OTHERS.items()
        },
    }


def rendered_figures(config: RigConfig, seconds: float, seeds: tuple[int, ...]) -> dict[str, Any]:
    """Figures on pictures: a hand still at two distances, moving, and with fingers that play.

    It moves at about 0.5 m/s RMS at 0.7 m; the fingers play at 0.5 m.
    """
    still = [
        Pictures(config, "still", distance_m, (0.0, 0.0, 0.0), seconds, seeds)
        for distance_m in (0.5, 1.0)
    ]
    figures = still_figures(still)
    figures |= moving_figures(Pictures(config, "random", 0.7, (0.085, 0.06, 0.07), seconds, seeds))
    piano = Pictures(config, "piano", 0.5, (0.0, 0.0, 0.0), seconds, seeds)
    figures["piano_0.5"] = {
        f"lag{lag}": piano.score(Fusion(lag_frames=lag)).figures() for lag in (0, 1, 2)
    }
    return figures


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument(
        "--synthetic-only",
        action="store_true",
        help="leave the pictures out: ten seconds instead of a minute",
    )
    parser.add_argument("--seconds", type=float, default=6.0, help="length of each rendered scene")
    parser.add_argument(
        "--seeds",
        default=",".join(map(str, RENDERED_SEEDS)),
        help="of the rendered scenes; constants were tuned on 1 to 4",
    )
    options = parser.parse_args()
    figures: dict[str, Any] = {}
    seeds = tuple(int(seed) for seed in options.seeds.split(","))
    if not options.synthetic_only:
        figures |= rendered_figures(
            load_rig(Path(__file__).parents[1] / "config" / "sim.toml"), options.seconds, seeds
        )
    figures |= cost()
    figures["load_8_markers_4_cameras_90_fps"] = cost(4, 90.0, markers=8)
    figures["synthetic"] = synthetic_figures()
    text = json.dumps(figures, indent=1)
    print(text)
    if options.json:
        options.json.write_text(text + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
