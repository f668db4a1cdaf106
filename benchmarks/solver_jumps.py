"""Does a solved hand jump where the recorded one does not move?

    python benchmarks/solver_jumps.py --half tuning
    python benchmarks/solver_jumps.py --half held-out --seeds 4 --json solver_jumps.json

Every recording of real hands at hand (four of a Leap, an optical glove) through the solver's step:
the wrist's marker behind the palm or on it, the recording's own bones and the tables' at its size,
at 110, 55 and 28 messages a second, with exact points and with .5 and 1 mm of white noise; at 28
also with one landmark after the other hidden for .3 s. A jump
is a change of more than 20 deg between two messages, of the wrist's orientation or of any joint,
beyond what the hand itself did: a Leap recording's own turn and bend; of the glove, whose joints
nobody knows, the turn of its points as one piece, and the bend that what is left of their motion
could be. Also by how much joints move from message to message beyond that (RMS), and the errors
against the recording's own angles, so that nothing is bought with sluggishness.

Tuning half: `grab`, `pinch`, the glove's first half minute and even seeds; held out: `HandSplay`,
`wave`, its second and odd seeds.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, angle_between, rotation_from_quaternion
from rhot.hand import BASIC_LANDMARKS, DIGITS, HandModel, default_hand, forward, landmark_point
from rhot.messages import HandPoint, HandPoints, HandPose
from services.simulator.recorded_motion.bones import DrivenHand, driven_hand
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints, RecordedPoints
from services.solver.step import SolverStep

JUMP_RAD = float(np.deg2rad(20.0))
LEAP = {"tuning": ("grab", "pinch"), "held-out": ("HandSplay-110fps", "wave")}
# The wrist marker behind the palm's centre, and the palm's centre itself.
BEHIND_M = {"wrist": 0.06, "palm": 0.0}
EVERY = (1, 2, 4)
NOISE_M = (0.0, 5e-4, 1e-3)
# What exact points are told as: the best that fusion tells.
_LEAST_SIGMA_M = 3e-4
# A joint that bends by 1 rad moves its tip by at least so much: the last bone and the paint.
_LEVER_M = 0.02


@dataclass(frozen=True)
class Take:
    """A hand's points, and what the hand did between one message and the next."""

    name: str
    model: HandModel
    times_s: Array  # (n,)
    points_m: Array  # (n, 6, 3) in the order of BASIC_LANDMARKS, NaN where hidden
    turned_rad: Array  # (n - 1,)
    bent_rad: Array  # (n - 1, 5, 1)
    truth: DrivenHand | None


@dataclass(frozen=True)
class Jump:
    """One jump: at which message of which take, of what, by how much, and what was told."""

    take: str
    message: int
    what: str
    deg: float
    told_deg: float
    landmarks_changed: bool


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--half", choices=list(LEAP), default="held-out")
    parser.add_argument("--seeds", type=int, default=2, help="of noise, for each level of it")
    parser.add_argument("--only", default="", help="takes whose name contains this")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    figures = {}
    groups: dict[str, list[tuple[list[Jump], dict[str, float]]]] = {}
    for take, noise_m, seed in cases(options.half, options.seeds):
        if options.only in take.name:
            found = played(take, noise_m, seed)
            groups.setdefault(take.name.split(", ", 1)[1], []).append(found)
            for jump in found[0]:
                print(f"  {jump}", flush=True)
    for name, found in groups.items():
        figures[name] = summary(name, found)
    print("all takes:", sum(figure["jumps"] for figure in figures.values()), "jumps")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


def summary(name: str, found: list[tuple[list[Jump], dict[str, float]]]) -> dict[str, float]:
    """Print and return the figures of takes that are alike."""
    jumps = [jump for some, _ in found for jump in some]
    values = {key: np.array([row[key] for _, row in found]) for key in found[0][1]}
    rows = {key: _together(key, value) for key, value in values.items()}
    figures = {
        "jumps": len(jumps),
        "landmarks_changed": sum(jump.landmarks_changed for jump in jumps),
        "messages": round(rows.pop("messages") * len(found)),
        **{key: round(value, 3) for key, value in rows.items()},
    }
    print(f"{name:24}", *(f"{key} {value:g}" for key, value in figures.items()))
    return figures


def _together(key: str, values: Array) -> float:
    """The largest of maxima, else the mean; NaN where there is no truth."""
    return float(values.max() if "most" in key else values.mean())


def cases(half: str, seeds: int) -> Iterator[tuple[Take, float, int]]:
    """Every take of a half with every noise."""
    for take in takes(half):
        for noise_m in NOISE_M:
            for k in range(seeds if noise_m else 1):
                yield take, noise_m, 2 * k + (half == "held-out")


def takes(half: str) -> Iterator[Take]:
    """The recordings of a half, played in all ways."""
    data = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    for name, every, marker in itertools.product(LEAP[half], EVERY, BEHIND_M):
        recorded = load_recording(data / f"hand_motion/leap/{name}.csv")
        assert isinstance(recorded, RecordedJoints)
        recorded = recorded.rows(np.arange(0, len(recorded.times_s), every))
        yield from leap_takes(f"{name} 1/{every}", recorded, marker)
    glove = load_recording(data / "hand_motion/qualisys/recording.tsv.gz")
    assert isinstance(glove, RecordedPoints)
    middle = len(glove.times_s) // 2
    part = slice(0, middle) if half == "tuning" else slice(middle, None)
    for every in EVERY:
        rows = slice(part.start, part.stop, every)
        times_s, points_m = glove.times_s[rows], glove.points_m[rows]
        yield glove_take(f"glove 1/{every}", RecordedPoints(glove.hand, times_s, points_m))


def leap_takes(name: str, recorded: RecordedJoints, marker: str) -> Iterator[Take]:
    """A Leap recording with its own bones, and with the tables' at its size."""
    hand = driven_hand(recorded)
    assert isinstance(hand, DrivenHand)
    place_m = hand.rotations[0].T @ (recorded.origin_m[0] - hand.wrist_m[0])
    place_m = place_m + np.array([0.0, 0.0, BEHIND_M[marker]])
    wrist_m = recorded.origin_m + BEHIND_M[marker] * recorded.axes[:, :, 2]
    points_m = np.concatenate([wrist_m[:, None], recorded.joints_m[:, :, 3]], axis=1)
    size = float(hand.model.lengths_m[1:].sum() / default_hand().lengths_m[1:].sum())
    bent = np.abs(np.diff(hand.angles_rad, axis=0)).max(axis=2, keepdims=True)
    turned = np.array([angle_between(a, b) for a, b in itertools.pairwise(hand.rotations)])
    for bones, model in (("own", hand.model), ("tables", default_hand(hand.hand, size))):
        painted = without_extent(model, tuple(place_m.tolist()))
        what = f"{name}, {marker} {bones}"
        yield Take(what, painted, hand.times_s, points_m, turned, bent, hand)
        if name.endswith("1/4"):
            gaps_m = hidden_in_turn(hand.times_s, points_m)
            yield Take(f"{what}, hidden", painted, hand.times_s, gaps_m, turned, bent, hand)


def hidden_in_turn(times_s: Array, points_m: Array) -> Array:
    """The same with one landmark after the other gone for .3 s, .1 s apart, after the first .2."""
    out = points_m.copy()
    for k, time_s in enumerate(times_s):
        turn, within_s = divmod(time_s - 0.2, 0.4)
        if turn >= 0.0 and within_s < 0.3:
            out[k, int(turn) % points_m.shape[1]] = np.nan
    return out


def without_extent(model: HandModel, wrist_m: tuple[float, float, float]) -> HandModel:
    """The hand with points as paint: tips at the ends of bones, the wrist's marker at wrist_m."""
    paint = {
        name: msgspec.structs.replace(dab, offset_m=(0.0, 0.0, 0.0))
        for name, dab in model.paint.items()
    }
    paint["wrist"] = msgspec.structs.replace(paint["wrist"], offset_m=wrist_m)
    return msgspec.structs.replace(model, paint=paint)


def glove_take(name: str, recorded: RecordedPoints) -> Take:
    """The glove, as the tables' hand that reaches as far."""
    points_m = recorded.points_m
    table = default_hand(recorded.hand)
    joints = forward(table, np.eye(3), np.zeros(3), np.zeros((5, 4)))
    wrist, *tips = (landmark_point(table, landmark, *joints) for landmark in BASIC_LANDMARKS)
    reach = np.nanpercentile(np.linalg.norm(points_m[:, 1:] - points_m[:, :1], axis=2), 98.0, 0)
    size = float(np.mean(reach[1:] / np.linalg.norm(np.array(tips) - wrist, axis=1)[1:]))
    turned, bent = zip(*(moved(a, b) for a, b in itertools.pairwise(points_m)), strict=True)
    bends = np.tile(np.array(bent)[:, None, None], (1, 5, 1))
    model = default_hand(recorded.hand, size)
    return Take(
        f"{name}, glove tables", model, recorded.times_s, points_m, np.array(turned), bends, None
    )


def moved(before: Array, after: Array) -> tuple[float, float]:
    """By how much points (6, 3) turned as one piece, and what is left as a bend, rad.

    Kabsch 1976.
    """
    seen = np.isfinite(before[:, 0]) & np.isfinite(after[:, 0])
    a, b = before[seen] - before[seen].mean(axis=0), after[seen] - after[seen].mean(axis=0)
    U, _, Vt = np.linalg.svd(b.T @ a)
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    left_m = float(np.linalg.norm(b - a @ R.T, axis=1).max())
    return angle_between(np.eye(3), R), left_m / _LEVER_M


def played(take: Take, noise_m: float, seed: int) -> tuple[list[Jump], dict[str, float]]:
    """The jumps of a take, and its figures."""
    rng = np.random.default_rng([seed, 5])
    step = SolverStep(RigConfig(), {take.model.hand: take.model})
    noise = rng.normal(0.0, noise_m, take.points_m.shape) if noise_m else 0.0
    poses = [step.step(message) for message in messages(take, take.points_m + noise, noise_m)]
    first = next(k for k, pose in enumerate(poses) if pose is not None)
    name = f"{take.name}, {1e3 * noise_m:g} mm seed {seed}"
    found, beyond = jumps_of(take, name, poses, first)
    return found, {"messages": len(poses), **beyond, **errors(take, poses, first)}


def messages(take: Take, points_m: Array, noise_m: float) -> Iterator[HandPoints]:
    """What fusion would send."""
    sigma_m = max(noise_m, _LEAST_SIGMA_M)
    for frame, places in enumerate(points_m):
        points = [
            HandPoint(
                name=landmark,
                position_m=tuple(place.tolist()),
                sigma_m=(sigma_m,) * 3,
                cameras=[],
                source="measured",
            )
            for landmark, place in zip(BASIC_LANDMARKS, places, strict=True)
            if np.isfinite(place[0])
        ]
        stamp_ns = 10**18 + round(1e9 * take.times_s[frame])
        yield HandPoints(hand=take.model.hand, seq=frame, stamp_ns=stamp_ns, points=points)


def jumps_of(
    take: Take, name: str, poses: list[HandPose | None], first: int
) -> tuple[list[Jump], dict[str, float]]:
    """The jumps, and how far orientation and joints move beyond the hand's own motion (RMS)."""
    jumps, beyond_turn, beyond_bend = [], [], []
    for k in range(first + 1, len(poses)):
        before, after = poses[k - 1], poses[k]
        if before is None or after is None:
            continue
        turn = angle_between(_rotation(before), _rotation(after)) - take.turned_rad[k - 1]
        bend = np.abs(_angles(after) - _angles(before)) - take.bent_rad[k - 1]
        changed = bool(np.any(np.isnan(take.points_m[k - 1]) != np.isnan(take.points_m[k])))
        beyond_turn.append(max(turn, 0.0))
        beyond_bend.append(np.maximum(bend, 0.0))
        if turn > JUMP_RAD:
            told = float(np.rad2deg(before.wrist_sigma_rad))
            jumps.append(Jump(name, k, "orientation", float(np.rad2deg(turn)), told, changed))
        for row, joint in np.argwhere(bend > JUMP_RAD):
            told = float(np.rad2deg(before.fingers[row].sigma_rad))
            deg, what = float(np.rad2deg(bend[row, joint])), f"{DIGITS[row]} angle {joint}"
            jumps.append(Jump(name, k, what, deg, told, changed))
    return jumps, {
        "turn_most_deg": float(np.rad2deg(np.max(beyond_turn))),
        "bend_most_deg": float(np.rad2deg(np.max(beyond_bend))),
        "bend_rms_deg": float(np.rad2deg(np.sqrt(np.mean(np.square(beyond_bend))))),
    }


def errors(take: Take, poses: list[HandPose | None], first: int) -> dict[str, float]:
    """Mean errors of orientation and flexion, deg, where the truth is known."""
    if take.truth is None:
        return {"orientation_deg": np.nan, "flexion_deg": np.nan}
    turns, bends = [], []
    for k, pose in enumerate(poses[first:], start=first):
        if pose is not None:
            turns.append(angle_between(_rotation(pose), take.truth.rotations[k]))
            bends.append(np.abs(_angles(pose) - take.truth.angles_rad[k])[1:, 1:].mean())
    return {
        "orientation_deg": float(np.rad2deg(np.mean(turns))),
        "flexion_deg": float(np.rad2deg(np.mean(bends))),
    }


def _rotation(pose: HandPose) -> Array:
    return rotation_from_quaternion(pose.wrist.orientation_wxyz)


def _angles(pose: HandPose) -> Array:
    return np.array([finger.model_angles_rad for finger in pose.fingers])


if __name__ == "__main__":
    main()
