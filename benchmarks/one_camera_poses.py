"""How far off a pose's finger tips are while one camera alone sees the hand.

`python benchmarks/one_camera_poses.py [--seeds N] [--json FILE]`

Hands of the simulator's gestures at .55 m, as points with .06 px of noise: joints that wander, a
hand that plays, one that closes, and one whose joints wander while it sways by 12 cm. Every 2.5 s
the second camera misses all markers for a second; fusion and solver run as they do live, at lag 0,
with the hand's true bones. In mm, RMS by the time since the second camera saw the hand: tips of the
pose, the points that fusion tells, and the plain method: the distance from the camera that each tip
had when both saw it, along the true ray.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from rhot.geometry.transforms import Array, rotation_from_quaternion, rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, HandModel, forward, landmark_point
from rhot.messages import HandPoints, HandPose, MarkerFrame
from services.fusion.step import FusionStep
from services.simulator.hands.gestures import MOTIONS
from services.solver.step import SolverStep
from testing.synthetic_points import START_NS, SyntheticRig, frames, point_hands

SECONDS, BEGIN_S, EVERY_S, GAP_S = 16.0, 2.0, 2.5, 1.0
EDGES_S = (0.1, 0.2, 0.3, 0.5, 1.0)
_HELD_UP = rotation_from_vector(np.array([1.2, 0.3, 0.1]))
_PLACE_M = np.array([0.03, 0.03, 0.55])
# How the swaying hand turns and shifts: rad and m, rad/s.
_TURN_RAD, _TURN_RAD_S = 0.5, np.array([3.1, 2.3, 2.7])
_SHIFT_M, _SHIFT_RAD_S = 0.12, np.array([2.9, 3.7, 2.1])

Joints = tuple[Array, Array]  # positions (26, 3), rotations (26, 3, 3)


class Sample(NamedTuple):
    """Errors in mm, so long after the second camera saw the hand."""

    age_s: float
    tips: list[float]
    points: list[float]
    plain: list[float]


def hand_at(name: str, model: HandModel, seed: int) -> Callable[[float], Joints]:
    """Joints of a gesture at a time (s)."""
    gesture = MOTIONS["random" if name == "swaying" else name](model, seed)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (2, 3))

    @cache
    def at(t_s: float) -> Joints:
        angles, turn, shift, *_ = gesture(t_s)
        if name == "swaying":
            turn = _TURN_RAD * np.sin(_TURN_RAD_S * t_s + phase[0])
            shift = _SHIFT_M * np.sin(_SHIFT_RAD_S * t_s + phase[1])
        rotation = _HELD_UP @ rotation_from_vector(np.asarray(turn))
        return forward(model, rotation, _PLACE_M + shift, angles)

    return at


def landmarks_of(model: HandModel, joints: Joints) -> Array:
    """The painted landmarks (6, 3), wrist first."""
    return np.array([landmark_point(model, name, *joints) for name in BASIC_LANDMARKS])


def _seen_at(model: HandModel, at: Callable[[float], Joints], times_s: list[float]) -> list[Array]:
    """The landmarks (6, 3), each at a time of its own."""
    marks = zip(BASIC_LANDMARKS, times_s, strict=True)
    return [landmark_point(model, mark, *at(t_s)) for mark, t_s in marks]


def samples(name: str, seed: int) -> list[Sample]:
    """One hand's, of all instants at which one camera sees it."""
    hands = point_hands()
    hands["right"] = model = msgspec.structs.replace(hands["right"], origin="measured")
    at = hand_at(name, model, seed)

    def motion(times_s: Array) -> Array:
        times = np.broadcast_to(times_s.reshape(len(times_s), -1), (len(times_s), 6)).tolist()
        return np.array(
            [
                [
                    landmark_point(model, mark, *at(t))
                    for mark, t in zip(BASIC_LANDMARKS, row, strict=True)
                ]
                for row in times
            ]
        )

    rig = SyntheticRig(loss=0.0, clock_error_s=0.0, seed=seed)
    fusion, solver = FusionStep(rig.config(), rig.rig(), hands), SolverStep(rig.config(), hands)
    found = []
    for frame in frames(rig, motion, SECONDS):
        for points in fusion.step(_as_seen(frame)):
            pose = solver.step(points)
            solver.challenge("right")
            if pose is not None:
                fusion.note_pose(pose)
                t_s = (points.stamp_ns - START_NS) * 1e-9
                if (age_s := _age_s(t_s)) is not None:
                    truth, before = (landmarks_of(model, at(t)) for t in (t_s, t_s - age_s))
                    found.append(_sample(model, age_s, (points, pose), truth, before))
    return found


def _age_s(t_s: float) -> float | None:
    """Since the second camera last saw the hand, None while it does."""
    age_s = (t_s - BEGIN_S) % EVERY_S
    return age_s if t_s >= BEGIN_S and age_s < GAP_S else None


def _as_seen(frame: MarkerFrame) -> MarkerFrame:
    hidden = _age_s((frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9) is not None
    return (
        msgspec.structs.replace(frame, markers=[]) if hidden and frame.camera == "right" else frame
    )


def _sample(
    model: HandModel, age_s: float, told: tuple[HandPoints, HandPose], truth: Array, before: Array
) -> Sample:
    points, pose = told
    positions = np.array([joint.position_m for joint in pose.joints])
    turns = [rotation_from_quaternion(np.array(joint.orientation_wxyz)) for joint in pose.joints]
    off = landmarks_of(model, (positions, np.array(turns))) - truth
    rows = [BASIC_LANDMARKS.index(point.name) for point in points.points]
    places = np.array([point.position_m for point in points.points]).reshape(-1, 3)
    # The first camera is the rig's origin.
    plain = np.linalg.norm(truth, axis=1) - np.linalg.norm(before, axis=1)
    return Sample(
        age_s,
        (1e3 * np.linalg.norm(off[1:], axis=1)).tolist(),
        (1e3 * np.linalg.norm(places - truth[rows], axis=1)).tolist(),
        (1e3 * np.abs(plain[1:])).tolist(),
    )


def figures(found: list[Sample]) -> dict[str, dict[str, float]]:
    """RMS of all, of the first .3 s and by age, 95 % and maximum; of tips, points and plain."""
    result = {}
    for kind in ("tips", "points", "plain"):
        values = [(one.age_s, mm) for one in found for mm in getattr(one, kind)]
        ages, errors = (np.array(column) for column in zip(*values, strict=True))
        rms = {"all": errors, "to_0.3": errors[ages < 0.3]}
        for low, high in zip((0.0, *EDGES_S), EDGES_S, strict=False):
            rms[f"{low}_to_{high}"] = errors[(ages >= low) & (ages < high)]
        result[kind] = {name: float(np.sqrt(np.mean(own**2))) for name, own in rms.items()}
        result[kind] |= {"p95": float(np.percentile(errors, 95.0)), "max": float(errors.max())}
    return result


def main() -> None:
    """Measure all gestures and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    table = {}
    print(f"{'mm':16}{'':8}{'<.3 s':>7}{'<1 s':>7}{'95 %':>7}{'max':>7}   by age, to .1 .. 1 s")
    for name in ("random", "piano", "fist", "swaying"):
        found = [one for seed in range(1, options.seeds + 1) for one in samples(name, seed)]
        table[name] = figures(found)
        for kind, own in table[name].items():
            by_age = "".join(f"{mm:7.1f}" for key, mm in own.items() if "_to_" in key)
            first = f"{own['to_0.3']:7.1f}{own['all']:7.1f}{own['p95']:7.1f}{own['max']:7.1f}"
            print(f"{name:16}{kind:8}{first}  {by_age}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
