"""What `rhot calibrate hand` gains: the solver's error with the tables' bones, with calibrated and
with true ones.

    python benchmarks/calibrate_hand.py --hands 4 --json calibrate_hand.json
    python benchmarks/calibrate_hand.py --hands 8 --only free

Simulated hands whose bones differ by 10 % from the tables, each finger by a factor of its own (kind
"finger") or each bone by its own (kind "bone", harder). The recording is the simulator's guided
scene as points with 1 mm noise, wrist + 5 tips; the error is measured on random motion with 1 mm
noise. Ratios of means against the true bones, in one process; deterministic.

Kind "free": people of any size (.8 to 1.15) whose bones differ by up to 10 % each, knuckles, paint
and directions besides, in a minute of free motion (random, fist, piano, wave, pinch, grab, or
without random); only odd seeds, for constants were chosen on even ones. Places of the knuckles in
the wrist frame, what their sigmas say, and the solver's errors, also with tables of the right size.

Kinds "people" and "bones": the same of testing/families/people.py: knuckles within 4 mm along each
axis, directions within 4 deg, tips painted 8 to 20 mm long, the wrist's dab 5 mm off; or bones
within 10 % alone. Odd seeds again.
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
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
)
from rhot.hand import BASIC_LANDMARKS, HandModel, default_hand
from rhot.hand_exercises import CYCLE_S
from rhot.messages import HandPoints, HandPose
from services.calibrator.hand.fit import fit_hand
from services.calibrator.hand.free_motion.estimate import estimate_hand
from services.calibrator.hand.free_motion.frames import seen_frames
from services.calibrator.hand.recording import sort_exercises
from services.simulator.hands.calibration_exercises import guided
from services.simulator.hands.gestures import MOTIONS, Motion
from services.simulator.hands.involuntary_motion import InvoluntaryMotion
from services.solver.step import SolverStep
from testing.families.people import PaintJob, Person
from testing.synthetic_hands import hand_message, noisy_points, with_bone_factors, wrist_rotation

_FPS = 30.0
# Of free motion; half of the people do not move at random.
_SCENES = ("random", "fist", "piano", "wave", "pinch", "grab")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hands", type=int, default=4, help="of each kind")
    parser.add_argument("--only", choices=_KINDS, help="one kind alone")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    print(f"{'kind':8}{'bones':12}{'flexion_deg':>12}{'orientation_deg':>17}{'ratios to true':>22}")
    kinds = [options.only] if options.only else _KINDS
    results: dict[str, dict[str, float]] = {}
    for kind in kinds:
        find = free if kind in _PEOPLE else measure
        results[kind] = find(kind, options.hands)
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
    return ratios(kind, errors)


def free(kind: str, hands: int) -> dict[str, float]:
    """The same from free motion, and errors of the knuckles."""
    errors: dict[str, list[tuple[float, float]]] = {}
    knuckles: dict[str, list[float]] = {}
    told: list[float] = []
    for seed in range(1, 2 * hands, 2):
        truth, size = _PEOPLE[kind](seed)
        table, sized = default_hand(truth.hand), default_hand(truth.hand, size)
        scenes = _SCENES if seed % 4 == 1 else _SCENES[1:]
        published = [
            message
            for k, scene in enumerate(scenes)
            for message in later(truth, scene, seed + k, 60.0 / len(scenes), 60.0 * k)
        ]
        found = estimate_hand(seen_frames(published, table), table)
        models = {"true": truth, "tables": table, "tables_sized": sized, "free": found.model}
        for name, model in models.items():
            errors.setdefault(name, []).append(solver_error(truth, model, seed))
            off = 1e3 * np.linalg.norm(_knuckles(model) - _knuckles(truth), axis=1)
            knuckles.setdefault(name, []).extend(off.tolist())
        told += (1e3 * found.knuckle_sigmas_m()).tolist()
    figures = ratios(kind, errors)
    for name, off in knuckles.items():
        figures[f"{name}_knuckles_mm"] = round(float(np.median(off)), 2)
        figures[f"{name}_knuckles_90_mm"] = round(float(np.percentile(off, 90)), 2)
        if name != "true":
            shown = f"median {np.median(off):.1f}, 90 % {np.percentile(off, 90):.1f}"
            print(f"{name:12} knuckles, mm: {shown}")
    figures["told_mm"] = round(float(np.median(told)), 2)
    square = np.mean((np.array(knuckles["free"]) / told) ** 2)
    worst = max(knuckles["free"])
    figures["free_knuckles_worst_mm"] = round(worst, 2)
    figures["error_by_sigma"] = round(float(np.sqrt(square)), 2)
    print(f"told {figures['told_mm']} mm; errors over sigmas, RMS: {figures['error_by_sigma']}")
    print(f"worst knuckle {worst:.1f} mm")
    return figures


def _knuckles(model: HandModel) -> Array:
    return np.array([digit.base_m for digit in model.digits[1:]])


def person(seed: int) -> tuple[HandModel, float]:
    """Somebody, and the size against the average adult's."""
    random = np.random.default_rng([seed, 99])
    size = float(random.uniform(0.8, 1.15))
    model = with_bone_factors(default_hand("right", size), random.uniform(0.9, 1.1, (5, 4)))
    digits = []
    for digit in model.digits:
        turn = rotation_from_vector(np.deg2rad(random.normal(0.0, 2.0, 3)))
        R = turn @ rotation_from_quaternion(digit.base_wxyz)
        base = np.array(digit.base_m) + random.normal(0.0, 1.5e-3, 3)
        digits.append(
            msgspec.structs.replace(
                digit,
                base_m=tuple(base.tolist()),
                base_wxyz=tuple(quaternion_from_rotation(R).tolist()),
                coupling=float(random.normal(2.0 / 3.0, 0.05)),
            )
        )
    paint = dict(model.paint)
    for name in BASIC_LANDMARKS:
        spread = (2e-3,) * 3 if name == "wrist" else (0.0, 0.0, 1.5e-3)
        offset = np.array(paint[name].offset_m) + random.normal(0.0, spread)
        paint[name] = msgspec.structs.replace(paint[name], offset_m=tuple(offset.tolist()))
    return msgspec.structs.replace(model, digits=tuple(digits), paint=paint), size


def family_member(seed: int) -> tuple[HandModel, float]:
    """Somebody of the families, painted in a hurry."""
    size = _family_size(seed)
    return PaintJob((8.0, 20.0), 5.0, seed=seed).on(Person(scale=size, seed=seed).model()), size


def bones_alone(seed: int) -> tuple[HandModel, float]:
    """Somebody of the families whose bones alone differ."""
    size = _family_size(seed)
    only = Person(scale=size, knuckle_mm=0.0, thumb_mm=0.0, turn_deg=0.0, seed=seed)
    return only.model(), size


def _family_size(seed: int) -> float:
    return float(np.random.default_rng([seed, 123]).uniform(0.8, 1.15))


# Kinds of people in free motion, by who they are.
_PEOPLE = {"free": person, "people": family_member, "bones": bones_alone}
_KINDS = ["finger", "bone", *_PEOPLE]


def later(
    model: HandModel, scene: str, seed: int, seconds: float, begin_s: float
) -> list[HandPoints]:
    """A scene as fusion would publish it, from begin_s on."""
    published, _ = messages(model, MOTIONS[scene](model, seed), seed, seconds)
    shift_ns = round(1e9 * begin_s)
    return [msgspec.structs.replace(m, stamp_ns=m.stamp_ns + shift_ns) for m in published]


def ratios(kind: str, errors: dict[str, list[tuple[float, float]]]) -> dict[str, float]:
    """Print and return mean errors, and their ratios to those with true bones."""
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
