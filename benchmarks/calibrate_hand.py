"""What `rhot calibrate hand` gains: the solver's error with the tables' bones, with calibrated and
with true ones.

    python benchmarks/calibrate_hand.py --hands 4 --json calibrate_hand.json

Simulated hands whose bones differ by 10 % from the tables, each finger by a factor of its own (kind
"finger") or each bone by its own (kind "bone", harder). The recording is the simulator's guided
scene as points with 1 mm noise, wrist + 5 tips; the error is measured on random motion with 1 mm
noise. Ratios of means against the true bones, in one process; deterministic.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, angle_between, rotation_from_quaternion
from rhot.hand import HandModel, default_hand
from rhot.hand_exercises import CYCLE_S
from rhot.messages import HandPoints, HandPose
from services.calibrator.hand.fit import fit_hand
from services.calibrator.hand.recording import sort_exercises
from services.simulator.hands.calibration_exercises import guided
from services.simulator.hands.gestures import MOTIONS, Motion
from services.simulator.hands.involuntary_motion import InvoluntaryMotion
from services.solver.step import SolverStep
from testing.synthetic_hands import hand_message, noisy_points, with_bone_factors, wrist_rotation

_FPS = 30.0


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hands", type=int, default=4, help="of each kind")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    print(f"{'kind':8}{'bones':12}{'flexion_deg':>12}{'orientation_deg':>17}{'ratios to true':>22}")
    results = {kind: measure(kind, options.hands) for kind in ("finger", "bone")}
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


def measure(kind: str, hands: int) -> dict[str, float]:
    """Mean errors over some hands of one kind, and their ratios to those with true bones."""
    errors: dict[str, list[tuple[float, float]]] = {}
    for seed in range(hands):
        truth = other_hand(kind, seed)
        table = default_hand(truth.hand)
        published, _ = messages(truth, guided(truth, seed), seed, CYCLE_S)
        problem, found = fit_hand(sort_exercises(published, table), table)
        calibrated = problem.parameters.model(found.x)
        for name, model in (("true", truth), ("tables", table), ("calibrated", calibrated)):
            errors.setdefault(name, []).append(solver_error(truth, model, seed))
    means = {name: np.mean(values, axis=0) for name, values in errors.items()}
    figures: dict[str, float] = {}
    for name, mean in means.items():
        ratio = mean / means["true"]
        print(f"{kind:8}{name:12}{mean[0]:12.2f}{mean[1]:17.2f}{ratio[0]:14.2f}{ratio[1]:8.2f}")
        figures |= {
            f"{name}_flexion_deg": round(float(mean[0]), 3),
            f"{name}_orientation_deg": round(float(mean[1]), 3),
            f"{name}_flexion_ratio": round(float(ratio[0]), 3),
            f"{name}_orientation_ratio": round(float(ratio[1]), 3),
        }
    return figures


def other_hand(kind: str, seed: int) -> HandModel:
    """A hand whose bones, metacarpals too, are 10 % longer or shorter than the tables'."""
    random = np.random.default_rng([seed, 3])
    signs = random.permutation([-1.0, 1.0, -1.0, 1.0, random.choice([-1.0, 1.0])])
    factors = [
        1.0 + 0.1 * (np.full(4, sign) if kind == "finger" else random.choice([-1.0, 1.0], 4))
        for sign in signs
    ]
    return with_bone_factors(default_hand(), np.array(factors))


def messages(
    model: HandModel, motion: Motion, seed: int, seconds: float
) -> tuple[list[HandPoints], list[tuple[Array, Array]]]:
    """A motion as fusion would publish it, and the true wrist rotation and angles of each frame."""
    random, unrest = np.random.default_rng([seed, 17]), InvoluntaryMotion(seed)
    published, truth = [], []
    for frame in range(int(seconds * _FPS)):
        gesture, (sway, shift) = motion(frame / _FPS), unrest(frame / _FPS)
        R = wrist_rotation(gesture, sway)
        position_m = np.array([0.0, 0.05, 0.5]) + gesture.shift_m + shift
        points = noisy_points(model, R, position_m, gesture.angles_rad, random)
        published.append(hand_message(model, frame, frame / _FPS, points))
        truth.append((R, gesture.angles_rad))
    return published, truth


def solver_error(truth: HandModel, model: HandModel, seed: int) -> tuple[float, float]:
    """Mean flexion error of the four fingers and mean orientation error, deg, with a hand model.

    Over random motion and fists.
    """
    flexion, orientation = [], []
    for kind in ("random", "fist"):
        published, true = messages(truth, MOTIONS[kind](truth, seed), seed + 100, 5.0)
        step = SolverStep(RigConfig(), {truth.hand: model})
        for message, (R, angles) in zip(published, true, strict=True):
            pose = step.step(message)
            if pose is None:
                raise SystemExit("the solver gave no pose")
            flexion.append(float(np.rad2deg(np.abs(_flexions(pose) - angles[1:, 1:]).mean())))
            found_R = rotation_from_quaternion(pose.wrist.orientation_wxyz)
            orientation.append(float(np.rad2deg(angle_between(found_R, R))))
    return float(np.mean(flexion)), float(np.mean(orientation))


def _flexions(pose: HandPose) -> Array:
    """Flexions (4, 3) of the fingers without the thumb, rad."""
    return np.array(
        [(f.angles_rad.mcp, f.angles_rad.pip, f.angles_rad.dip) for f in pose.fingers[1:]]
    )


if __name__ == "__main__":
    main()
