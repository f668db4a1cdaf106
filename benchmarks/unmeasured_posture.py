"""How right is the posture of a hand that nobody measured, from wrist and tips of real hands?

    python benchmarks/unmeasured_posture.py [--json FILE]

Real joints of two trackers of hands: four recordings of a Leap and three OpenXR poses. Each hand's
dab on the wrist and the middles of five painted tips, exact, go through the solver with the bones
of the tables, as large as the hand's fingers say, and 5 and 12 % larger and smaller, as a user
would guess. Of each recording, RMS in degrees over these five: the wrist's orientation, and the
directions of the last bones of the thumb and of the fingers; and the same of a plain way, the
tables' hand at rest put where its six points fit best (Kabsch). And how far off the size is that
the solver has in the end, RMS in per cent. Poses are held for two seconds.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, angle_between, rotation_from_quaternion
from rhot.hand import (
    BASIC_LANDMARKS,
    DIGITS,
    JOINT_INDEX,
    HandModel,
    HandName,
    default_hand,
    forward,
    landmark_point,
)
from rhot.messages import HandPoint, HandPoints
from services.simulator.recorded_motion.bones import driven_hand
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints
from services.solver.step import SolverStep
from services.solver.whole_hand.priors.posture_prior import posture_prior

LEAP = ("grab", "pinch", "HandSplay-110fps", "wave")
SIZES = (0.88, 0.95, 1.0, 1.05, 1.12)
SIGMA_M = 1e-3
# Half of what the tables' hand has painted of a tip; and how far a finger goes on beyond the end of
# its last bone, which is where a Leap's tip is.
PAINTED_M, PULP_M = 0.007, 0.004
# Messages a second, and what is left out at the beginning.
RATE_HZ, WARM_S, HELD_S = 30.0, 0.3, 2.0
# Where the tables have a dab, under the wrist.
DAB_M = np.array([0.0, -0.021, 0.0])


@dataclass(frozen=True)
class Hand:
    """A real hand: its landmarks, its wrist's axes, the directions of its last bones."""

    name: str
    side: HandName
    size: float
    times_s: Array  # (n,)
    points_m: Array  # (n, 6, 3) in the order of BASIC_LANDMARKS
    axes: Array  # (n, 3, 3)
    last: Array  # (n, 5, 3)


def hand_of(
    name: str,
    side: HandName,
    times_s: Array,
    wrist: tuple[Array, Array],
    joints: Array,
    end_m: float,
) -> Hand:
    """A hand of its wrist's places (n, 3) and axes (n, 3, 3) and its joints (n, 5, 4, 3); fingers
    end so far beyond the last.
    """
    (places, axes), bones = wrist, np.diff(joints, axis=2)
    last = bones[:, :, 2] / np.linalg.norm(bones[:, :, 2], axis=2)[..., None]
    lengths_m = np.linalg.norm(bones[:, 1:], axis=3)[:, :, :2].mean()
    size = float(lengths_m / default_hand(side).lengths_m[1:, :2].mean())
    tips = joints[:, :, 3] + (end_m - PAINTED_M * size) * last
    dab = places + axes @ (DAB_M * size)
    return Hand(name, side, size, times_s, np.concatenate([dab[:, None], tips], axis=1), axes, last)


def recordings(folder: Path) -> Iterator[Hand]:
    """Of a Leap; their wrist is where the tables' hand has it below its knuckles."""
    for name in LEAP:
        recorded = load_recording(folder / "leap" / f"{name}.csv")
        if isinstance(recorded, RecordedJoints):
            times_s = np.arange(0.0, recorded.times_s[-1], 1.0 / RATE_HZ)
            rows = recorded.rows(np.unique(np.searchsorted(recorded.times_s, times_s)))
            wrist = driven_hand(rows).wrist_m, rows.axes
            yield hand_of(name, rows.hand, rows.times_s, wrist, rows.joints_m, PULP_M)


def poses(folder: Path) -> Iterator[Hand]:
    """OpenXR's, of a left hand; they are held."""
    bones = ("phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip")
    fingers = ("index-finger", "middle-finger", "ring-finger", "pinky-finger")
    thumb = [
        f"thumb-{bone}" for bone in ("metacarpal", "phalanx-proximal", "phalanx-distal", "tip")
    ]
    names = [thumb, *([f"{finger}-{bone}" for bone in bones] for finger in fingers)]
    for path in sorted((folder / "openxr_poses").glob("*.json")):
        read = json.loads(path.read_text())["jointTransforms"]
        at = {name: np.array(one["offsetMatrix"]).reshape(4, 4).T for name, one in read.items()}
        times_s = np.arange(0.0, WARM_S + HELD_S, 1.0 / RATE_HZ)
        joints = np.array([[at[name][:3, 3] for name in chain] for chain in names])
        held = [np.repeat(one[None], len(times_s), axis=0) for one in (joints, at["wrist"])]
        wrist = held[1][:, :3, 3], held[1][:, :3, :3]
        yield hand_of(f"{path.stem} (pose)", "left", times_s, wrist, held[0], 0.0)


def solved(hand: Hand, step: SolverStep) -> Iterator[tuple[int, Array, Array]]:
    """Of each message: its number, the wrist's orientation (3, 3), last bones (5, 3)."""
    tips = [f"{one}_tip" for one in DIGITS]
    for k, (at_s, points) in enumerate(zip(hand.times_s, hand.points_m, strict=True)):
        told = [
            HandPoint(
                name=name,
                position_m=tuple(point),
                sigma_m=(SIGMA_M,) * 3,
                cameras=["left", "right"],
                source="measured",
            )
            for name, point in zip(BASIC_LANDMARKS, points.tolist(), strict=True)
        ]
        stamp_ns = 10**18 + round(float(at_s) * 1e9)
        pose = step.step(HandPoints(hand=hand.side, seq=k, stamp_ns=stamp_ns, points=told))
        if step.challenge_due(hand.side):
            step.challenge(hand.side)
        if pose is not None and at_s >= WARM_S:
            joints = [pose.joints[JOINT_INDEX[name]].orientation_wxyz for name in tips]
            last = np.array([-rotation_from_quaternion(one)[:, 2] for one in joints])
            yield k, rotation_from_quaternion(pose.wrist.orientation_wxyz), last


def at_rest(hand: Hand, model: HandModel) -> Iterator[tuple[int, Array, Array]]:
    """The same of a hand at rest that is put where its points fit best."""
    angles_rad = posture_prior(model).mean.reshape(5, 4)
    positions, rotations = forward(model, np.eye(3), np.zeros(3), angles_rad)
    own = np.array([landmark_point(model, name, positions, rotations) for name in BASIC_LANDMARKS])
    last = np.array([-rotations[JOINT_INDEX[f"{one}_tip"]][:, 2] for one in DIGITS])
    for k in np.flatnonzero(hand.times_s >= WARM_S).tolist():
        points = hand.points_m[k]
        turn, _ = Rotation.align_vectors(points - points.mean(axis=0), own - own.mean(axis=0))
        yield k, turn.as_matrix(), turn.apply(last)


def errors_deg(hand: Hand, found: Iterator[tuple[int, Array, Array]]) -> Array:
    """(m, 6): of the orientation, and of the last bones."""
    rows = [
        [
            angle_between(hand.axes[k], turn),
            *np.arccos(np.clip((hand.last[k] * last).sum(1), -1, 1)),
        ]
        for k, turn, last in found
    ]
    return np.rad2deg(np.array(rows))


def figures_of(hand: Hand) -> dict[str, float]:
    """RMS in degrees over the sizes, of the solver and of the plain way."""
    models = [default_hand(hand.side, hand.size * share) for share in SIZES]
    steps = [SolverStep(RigConfig(), {hand.side: model}) for model in models]
    errors = {
        "": [errors_deg(hand, solved(hand, step)) for step in steps],
        "_plain": [errors_deg(hand, at_rest(hand, model)) for model in models],
    }
    figures = {}
    for way, rows in errors.items():
        squares = np.concatenate(rows) ** 2
        figures |= {
            f"orientation{way}": float(np.sqrt(squares[:, 0].mean())),
            f"thumb{way}": float(np.sqrt(squares[:, 1].mean())),
            f"fingers{way}": float(np.sqrt(squares[:, 2:].mean())),
        }
    found = [
        share * (step.size(hand.side) or 1.0) for share, step in zip(SIZES, steps, strict=True)
    ]
    figures["size"] = 100.0 * float(np.sqrt(np.mean((np.array(found) - 1.0) ** 2)))
    return {name: round(value, 2) for name, value in figures.items()}


def main() -> None:
    """Print a row for each recording and the means, and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    data = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    folder = data / "hand_motion"
    if not folder.is_dir():
        raise SystemExit(f"no real recordings at {data}; set RHOT_DATA to their folder")
    found = {
        hand.name: figures_of(hand) for hand in itertools.chain(recordings(folder), poses(folder))
    }
    leap, openxr = (
        [found[name] for name in found if ("(pose)" in name) == held] for held in (0, 1)
    )
    for name, some in (("leap", leap), ("openxr", openxr)):
        found[name] = {key: round(float(np.mean([row[key] for row in some])), 2) for key in some[0]}
    print(f"{'deg RMS':<20}" + "".join(f"{name:>19}" for name in next(iter(found.values()))))
    for name, row in found.items():
        print(f"{name:<20}" + "".join(f"{value:19.1f}" for value in row.values()))
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
