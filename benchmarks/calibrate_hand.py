"""What `rhot calibrate hand` is worth: the solver's error with the tables' bones, with calibrated
ones, with the true ones.

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

import msgspec
import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.transforms import (
    Array,
    angle_between,
    rotation_from_quaternion,
    rotation_from_vector,
)
from rhot.hand import BASIC_LANDMARKS, HandModel, default_hand, forward, landmark_point
from rhot.hand_exercises import CYCLE_S
from rhot.messages import HandPoint, HandPoints, HandPose
from services.calibrator.hand.fit import fit_person
from services.calibrator.hand.recording import recording_of
from services.simulator.scene.calibration_exercises import guided
from services.simulator.scene.gestures import MOTIONS, Motion
from services.simulator.scene.involuntary_motion import InvoluntaryMotion
from services.solver.step import SolverStep

_NOISE_M, _FPS = 1e-3, 30.0
_START = rotation_from_vector(np.array([1.2, 0.3, 0.1]))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hands", type=int, default=4, help="of each kind")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    results: dict[str, dict[str, list[float]]] = {}
    print(f"{'kind':8}{'bones':12}{'flexion_deg':>12}{'orientation_deg':>17}{'ratios to true':>22}")
    for kind in ("finger", "bone"):
        errors: dict[str, list[tuple[float, float]]] = {}
        for seed in range(options.hands):
            truth = other_hand(kind, seed)
            table = default_hand(truth.hand)
            problem, found = fit_person(
                recording_of(messages(truth, guided(truth, seed), seed, CYCLE_S)[0], table), table
            )
            for name, model in (
                ("true", truth),
                ("tables", table),
                ("calibrated", problem.shape.model(found.x)),
            ):
                errors.setdefault(name, []).append(solver_error(truth, model, seed))
        means = {name: np.mean(values, axis=0) for name, values in errors.items()}
        results[kind] = {}
        for name, mean in means.items():
            ratio = mean / means["true"]
            print(f"{kind:8}{name:12}{mean[0]:12.2f}{mean[1]:17.2f}{ratio[0]:14.2f}{ratio[1]:8.2f}")
            results[kind] |= {
                f"{name}_flexion_deg": round(float(mean[0]), 3),
                f"{name}_orientation_deg": round(float(mean[1]), 3),
            }
            results[kind] |= {
                f"{name}_flexion_ratio": round(float(ratio[0]), 3),
                f"{name}_orientation_ratio": round(float(ratio[1]), 3),
            }
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


def other_hand(kind: str, seed: int) -> HandModel:
    """A hand whose bones, metacarpals too, are 10 % longer or shorter than the tables'."""
    rng = np.random.default_rng([seed, 3])
    signs = rng.permutation([-1.0, 1.0, -1.0, 1.0, rng.choice([-1.0, 1.0])])
    digits = []
    for digit, sign in zip(default_hand().digits, signs, strict=True):
        factors = 1.0 + 0.1 * (np.full(4, sign) if kind == "finger" else rng.choice([-1.0, 1.0], 4))
        start = np.array(digit.metacarpal_m)
        base = start + factors[3] * (np.array(digit.base_m) - start)
        lengths = factors[:3] * np.array(digit.lengths_m)
        digits.append(
            msgspec.structs.replace(
                digit, base_m=tuple(base.tolist()), lengths_m=tuple(lengths.tolist())
            )
        )
    return msgspec.structs.replace(default_hand(), digits=tuple(digits))


def messages(
    model: HandModel, motion: Motion, seed: int, seconds: float
) -> tuple[list[HandPoints], list[tuple[Array, Array]]]:
    """A motion as fusion would tell it, and the truth: wrist rotation and angles of every frame."""
    rng, unrest = np.random.default_rng([seed, 17]), InvoluntaryMotion(seed)
    told, truth = [], []
    for frame in range(int(seconds * _FPS)):
        gesture, (turn, shift) = motion(frame / _FPS), unrest(frame / _FPS)
        R = _START @ rotation_from_vector(gesture.turn_rad) @ rotation_from_vector(turn)
        joints = forward(
            model, R, np.array([0.0, 0.05, 0.5]) + gesture.shift_m + shift, gesture.angles_rad
        )
        points = [
            HandPoint(
                name=name,
                position_m=tuple(
                    (landmark_point(model, name, *joints) + rng.normal(0.0, _NOISE_M, 3)).tolist()
                ),
                sigma_m=(_NOISE_M,) * 3,
                cameras=["left", "right"],
                source="measured",
            )
            for name in BASIC_LANDMARKS
        ]
        told.append(
            HandPoints(
                hand=model.hand,
                seq=frame,
                stamp_ns=10**18 + round(frame * 1e9 / _FPS),
                points=points,
            )
        )
        truth.append((R, gesture.angles_rad))
    return told, truth


def solver_error(truth: HandModel, model: HandModel, seed: int) -> tuple[float, float]:
    """Mean flexion error of the four fingers and mean orientation error in degrees, over random
    motion and fists.
    """
    flexion, turn = [], []
    for kind in ("random", "fist"):
        told, true = messages(truth, MOTIONS[kind](truth, seed), seed + 100, 5.0)
        step = SolverStep(RigConfig(), {truth.hand: model})
        for message, (R, angles) in zip(told, true, strict=True):
            pose = step.step(message)
            if pose is None:
                raise SystemExit("the solver gave no pose")
            flexion.append(float(np.rad2deg(np.abs(_angles(pose) - angles[1:, 1:]).mean())))
            turn.append(
                float(
                    np.rad2deg(
                        angle_between(rotation_from_quaternion(pose.wrist.orientation_wxyz), R)
                    )
                )
            )
    return float(np.mean(flexion)), float(np.mean(turn))


def _angles(pose: HandPose) -> Array:
    return np.array(
        [(f.angles_rad.mcp, f.angles_rad.pip, f.angles_rad.dip) for f in pose.fingers[1:]]
    )


if __name__ == "__main__":
    main()
