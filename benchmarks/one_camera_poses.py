"""How far off a pose's finger tips are that one camera alone sees.

`python benchmarks/one_camera_poses.py [--tuning] [--seeds N] [--json FILE]`

Hands of the simulator's gestures at .55 m, as points with .06 px of noise: joints that wander, a
hand that plays, one that closes, and one whose joints wander while it turns and sways by 12 cm,
within both pictures. Every 2.5 s the second camera misses all markers for a second, or three finger
tips for half a second; fusion and solver run as they do live, at lag 0, with the hand's true bones.
In mm, over the tips that it misses, RMS by the time since it saw them: tips of the pose, the points
that fusion tells, and the plain method: the distance from the camera that each tip had when both
saw it, along the true ray. The tuning half has other gestures, and other seeds of these.
"""

from __future__ import annotations

import argparse
import itertools
import json
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import BASIC_LANDMARKS, TIPS, HandModel, landmark_point
from rhot.messages import HandPoints, HandPose, MarkerFrame
from services.fusion.step import FusionStep
from services.solver.step import SolverStep
from testing.gesture_points import FIRST_TUNING_SEED, SWAYING, Joints, hand_at, motion_of
from testing.synthetic_points import COLORS, START_NS, SyntheticRig, frames, point_hands

SECONDS, BEGIN_S, EVERY_S = 16.0, 2.0, 2.5
EDGES_S = (0.1, 0.2, 0.3, 0.5, 1.0)
GESTURES = {
    "reported": ("random", "piano", "fist", SWAYING + "random"),
    "tuning": (
        *("random", "piano", "fist", "grab", "pinch", "wave", "still"),
        *(SWAYING + name for name in ("random", "piano", "fist", "grab", "pinch")),
    ),
}
# The first of the seeds of a half.
_FIRST_SEED = {"reported": 1, "tuning": FIRST_TUNING_SEED}


class Gap(NamedTuple):
    """Which landmarks the second camera misses, and for how long."""

    landmarks: tuple[int, ...]
    seconds: float


GAPS = {"all, 1 s": Gap((0, 1, 2, 3, 4, 5), 1.0), "three tips, .5 s": Gap((2, 3, 4), 0.5)}


class Sample(NamedTuple):
    """Errors in mm of the tips that the second camera misses, so long after it saw them."""

    age_s: float
    tips: list[float]
    points: list[float]
    plain: list[float]


def landmarks_of(model: HandModel, joints: Joints) -> Array:
    """The painted landmarks (6, 3), wrist first."""
    return np.array([landmark_point(model, name, *joints) for name in BASIC_LANDMARKS])


def samples(name: str, seed: int, gap: Gap) -> list[Sample]:
    """One hand's, of all instants of its gaps."""
    hands = point_hands()
    hands["right"] = model = msgspec.structs.replace(hands["right"], origin="measured")
    at = hand_at(name, model, seed)

    rig = SyntheticRig(loss=0.0, clock_error_s=0.0, seed=seed)
    fusion, solver = FusionStep(rig.config(), rig.rig(), hands), SolverStep(rig.config(), hands)
    found = []
    for frame in frames(rig, motion_of(model, at), SECONDS):
        for points in fusion.step(_as_seen(frame, gap)):
            pose = solver.step(points)
            solver.challenge("right")
            if pose is not None:
                fusion.note_pose(pose)
                t_s = (points.stamp_ns - START_NS) * 1e-9
                if (age_s := _age_s(t_s, gap)) is not None:
                    truth, before = (landmarks_of(model, at(t)) for t in (t_s, t_s - age_s))
                    found.append(_sample(model, (age_s, gap), (points, pose), truth, before))
    return found


def _age_s(t_s: float, gap: Gap) -> float | None:
    """Since the second camera last saw all of the hand, None while it does."""
    age_s = (t_s - BEGIN_S) % EVERY_S
    return age_s if t_s >= BEGIN_S and age_s < gap.seconds else None


def _as_seen(frame: MarkerFrame, gap: Gap) -> MarkerFrame:
    t_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
    if frame.camera != "right" or _age_s(t_s, gap) is None:
        return frame
    hidden = {COLORS[landmark] for landmark in gap.landmarks}
    seen = [marker for marker in frame.markers if marker.color not in hidden]
    return msgspec.structs.replace(frame, markers=seen)


def _sample(
    model: HandModel,
    when: tuple[float, Gap],
    told: tuple[HandPoints, HandPose],
    truth: Array,
    before: Array,
) -> Sample:
    (age_s, gap), (points, pose) = when, told
    missed = [landmark for landmark in gap.landmarks if BASIC_LANDMARKS[landmark] in TIPS]
    positions = np.array([joint.position_m for joint in pose.joints])
    turns = [rotation_from_quaternion(np.array(joint.orientation_wxyz)) for joint in pose.joints]
    off = landmarks_of(model, (positions, np.array(turns))) - truth
    places = {BASIC_LANDMARKS.index(point.name): point.position_m for point in points.points}
    off_points = [places[n] - truth[n] for n in missed if n in places]
    # The first camera is the rig's origin.
    plain = np.linalg.norm(truth, axis=1) - np.linalg.norm(before, axis=1)
    return Sample(
        age_s,
        (1e3 * np.linalg.norm(off[missed], axis=1)).tolist(),
        [1e3 * float(np.linalg.norm(error)) for error in off_points],
        (1e3 * np.abs(plain[missed])).tolist(),
    )


def figures(found: list[Sample]) -> dict[str, dict[str, float]]:
    """RMS of all, of the first .3 s and by age, 95 % and maximum; of tips, points and plain."""
    result = {}
    for kind in ("tips", "points", "plain"):
        values = [(one.age_s, mm) for one in found for mm in getattr(one, kind)]
        ages, errors = (np.array(column) for column in zip(*values, strict=True))
        rms = {"all": errors, "to_0.3": errors[ages < 0.3]}
        for low, high in itertools.pairwise((0.0, *EDGES_S)):
            if (ages >= low).any():
                rms[f"{low}_to_{high}"] = errors[(ages >= low) & (ages < high)]
        result[kind] = {name: float(np.sqrt(np.mean(own**2))) for name, own in rms.items()}
        result[kind] |= {"p95": float(np.percentile(errors, 95.0)), "max": float(errors.max())}
    return result


def main() -> None:
    """Measure all gestures and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the half that constants are from")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half = "tuning" if options.tuning else "reported"
    seeds = range(_FIRST_SEED[half], _FIRST_SEED[half] + options.seeds)
    table: dict[str, dict[str, dict[str, dict[str, float]]]] = {}
    for title, gap in GAPS.items():
        print(f"\n{title:16}{'mm':8}{'<.3 s':>7}{'all':>7}{'95 %':>7}{'max':>7}   by age, to .1 ..")
        table[title] = {}
        for name in GESTURES[half]:
            found = figures([one for seed in seeds for one in samples(name, seed, gap)])
            table[title][name] = found
            for kind, own in found.items():
                by_age = "".join(f"{mm:7.1f}" for key, mm in own.items() if "_to_" in key)
                first = f"{own['to_0.3']:7.1f}{own['all']:7.1f}{own['p95']:7.1f}{own['max']:7.1f}"
                print(f"{name:16}{kind:8}{first}  {by_age}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
