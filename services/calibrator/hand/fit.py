"""From the frames of a guided recording to a person's hand. Pure and deterministic.

Frames are (m landmarks) points in the rig frame with their sigmas, NaN where a landmark was not
measured. Too little data of an exercise is a CalibrationError that names the exercise and what was
wrong with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from rhot.hand import TIPS, HandModel, default_hand, forward, landmark_point
from rhot.hand_exercises import EXERCISES, Exercise
from services.calibrator.hand.adjust import Adjusted, adjust
from services.calibrator.hand.hand_parameters import Shape
from services.calibrator.hand.landmark_jacobian import marks_of
from services.calibrator.hand.problem import Poses, Problem, Take

# Frames of each exercise that are used. More are no better: what is wrong with them (held fingers
# that twitch, neighbours that follow) is the same in all. On four simulated hands the solver's
# flexion error was 1.47 times that with true bones at 30, 1.31 at 12.
FRAMES = 12
# What a held finger twitches, and skin moves over bone, beside the measurement's own noise: 1.47
# times at 1 mm, 1.31 at 2 mm; on six other hands orientation 1.2 times at 2 mm, 1.1 at 3 mm.
_TWITCH_M = 3e-3
# How straight "straight" is: abduction, first, second and last flexion; and the thumb's rest, which
# nobody is told.
_STRAIGHT_DEG, _STRAIGHT_SD_DEG = (0.0, 4.0, 4.0, 0.0), (5.0, 6.0, 5.0, 4.0)
_THUMB_DEG, _THUMB_SD_DEG = (5.0, 0.0, 10.0, 2.0), (10.0, 12.0, 10.0, 8.0)
# A moving joint may be anywhere in its range; this only keeps one that nothing shows finite.
# Neighbours follow a little.
_FREE_RAD, _FOLLOW_RAD = math.radians(60.0), math.radians(5.0)
# First guesses of a moving flexion; the one that explains the frame best is the start.
_GUESSES_DEG = (5.0, 30.0, 55.0, 80.0)
# Least tip movement (m) against the wrist that tells an exercise from standing still: a bend of a
# quarter of the way.
_LEAST_MOVE_M = 0.02
# Of an exercise's frames, how many must show wrist and all tips for its take to count.
_LEAST_FRAMES = 10


@dataclass(frozen=True)
class Recording:
    """Frames of every exercise by name: points (n, m, 3) m, NaN where missing, and sigmas (n, m, 3)
    m; names (m,) of the landmarks.
    """

    names: tuple[str, ...]
    points: Mapping[str, Array]
    sigmas: Mapping[str, Array]


def moving(exercise: Exercise) -> dict[int, float]:
    """Angles that change during an exercise and their standard deviation, rad.

    A last joint follows by its coupling.
    """
    if exercise.kind == "spread":
        return dict.fromkeys((4, 12, 16), _FREE_RAD)
    column = {"knuckle": 1, "hook": 2, "thumb": 2}.get(exercise.kind)
    if column is None:
        return {}
    angles = {4 * exercise.digit + column: _FREE_RAD}
    if exercise.digit > 0:
        angles |= {
            4 * row + 1: _FOLLOW_RAD
            for row in (exercise.digit - 1, exercise.digit + 1)
            if 1 <= row <= 4
        }
    return angles


def fit_person(
    recording: Recording, table: HandModel, lengths_m: Mapping[tuple[int, int], float] | None = None
) -> tuple[Problem, Adjusted]:
    """The person of a recording; table gives the proportions, lengths_m what was measured by hand.

    Raises CalibrationError saying which exercise cannot be used and why.
    """
    problems = doubts(recording)
    if problems:
        raise CalibrationError("the recording does not determine the hand: " + "; ".join(problems))
    scale = _scale(recording, table)
    shape = Shape(default_hand(table.hand, scale), recording.names, lengths_m)
    used = [exercise for exercise in EXERCISES if exercise.kind != "fist"]
    takes, points, sigmas = [], [], []
    for exercise in used:
        rows = _chosen(recording.points[exercise.name])
        points.append(recording.points[exercise.name][rows])
        sigmas.append(recording.sigmas[exercise.name][rows])
        takes.append(_take(exercise, len(rows)))
    all_points, seen = np.concatenate(points), ~np.isnan(np.concatenate(points))
    weights = np.where(seen, 1.0 / (np.concatenate(sigmas) ** 2 + _TWITCH_M**2), 0.0)
    problem = Problem(shape, np.where(seen, all_points, 0.0), np.nan_to_num(weights), tuple(takes))
    x = np.zeros(shape.unknowns)
    return problem, adjust(problem, x, first_poses(problem, x))


def doubts(recording: Recording) -> list[str]:
    """What is missing, in words for the person; empty if every exercise can be used."""
    found = []
    for exercise in EXERCISES:
        points = recording.points.get(exercise.name)
        if points is None or len(points) == 0:
            found.append(f"{exercise.name}: nothing was recorded")
            continue
        seen = ~np.isnan(points[:, :, 0])
        if exercise.kind != "fist" and int(seen.all(axis=1).sum()) < _LEAST_FRAMES:
            name = recording.names[int(seen.mean(axis=0).argmin())]
            found.append(
                f"{exercise.name}: {name} was measured in {int(seen.mean(axis=0).min() * 100)} % of {len(points)} frames only"
            )
        elif exercise.digit >= 0:
            tip = recording.names.index(TIPS[exercise.digit])
            wrist = recording.names.index("wrist")
            far = np.linalg.norm(points[:, tip] - points[:, wrist], axis=1)
            if not float(np.nanmax(far) - np.nanmin(far)) > (
                _LEAST_MOVE_M if exercise.digit else 0.25 * _LEAST_MOVE_M
            ):
                found.append(
                    f"{exercise.name}: the {TIPS[exercise.digit].replace('_', ' ')} did not move ({exercise.prompt})"
                )
    return found


def _chosen(points: Array) -> npt.NDArray[np.int64]:
    """Rows of up to FRAMES frames, evenly over those that show everything."""
    whole = np.nonzero(~np.isnan(points).any(axis=(1, 2)))[0]
    return whole[
        np.unique(np.linspace(0, len(whole) - 1, min(FRAMES, len(whole))).round().astype(np.int64))
    ]


def _scale(recording: Recording, table: HandModel) -> float:
    """Size of the hand against the tables' from the open hand: wrist marker to finger tips."""
    joints = forward(default_hand(table.hand), np.eye(3), np.zeros(3), np.zeros((5, 4)))
    own = {name: landmark_point(table, name, *joints) for name in recording.names}
    wrist, points = recording.names.index("wrist"), recording.points["open"]
    ratios = []
    for tip in TIPS[1:]:
        far = np.nanmedian(
            np.linalg.norm(points[:, recording.names.index(tip)] - points[:, wrist], axis=1)
        )
        ratios.append(far / np.linalg.norm(own[tip] - own["wrist"]))
    scale = float(np.mean(ratios))
    if not 0.4 <= scale <= 1.6:
        raise CalibrationError(
            f"the open hand is {scale:.2f} times the size of an adult's: are units and markers of rig.toml right?"
        )
    return scale


def _take(exercise: Exercise, count: int) -> Take:
    expected = np.deg2rad(np.concatenate([_THUMB_DEG, *(_STRAIGHT_DEG,) * 4]))
    sd = np.deg2rad(np.concatenate([_THUMB_SD_DEG, *(_STRAIGHT_SD_DEG,) * 4]))
    # The middle finger does not abduct (RHOT section 3.1).
    sd[8] = np.deg2rad(0.5)
    return Take(exercise.name, count, moving(exercise), expected, sd)


def first_poses(problem: Problem, x: Array) -> Poses:
    """Where to begin: of a few bends of what moves, the one whose landmarks fit each frame best,
    laid on rigidly (Kabsch 1976).
    """
    n, f = len(problem.points), problem.most
    measures, best = problem.shape.geometry(x), np.full(n, np.inf)
    # Only the flexion that is exercised is tried bent; a bend of what is spread, or follows, is
    # small.
    bends = np.array(
        [
            [a % 4 > 0 and sd >= _FREE_RAD for a, sd in take.moving.items()]
            + [False] * (f - len(take.moving))
            for take in problem.takes
        ]
    )
    R, t, moving_rad = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), np.zeros((n, f))
    for guess in np.deg2rad(_GUESSES_DEG):
        tried = np.where(bends[problem.take_of], guess, 0.0)
        poses = Poses(R, t, tried, problem.expected)
        marks = marks_of(
            problem.shape, measures, problem.angles(measures, poses), problem.shape.table.side
        ).points
        new_R, new_t, cost = _laid(marks, problem.points, problem.weights[:, :, 0] > 0.0)
        better = cost < best
        R, t = np.where(better[:, None, None], new_R, R), np.where(better[:, None], new_t, t)
        moving_rad, best = np.where(better[:, None], tried, moving_rad), np.minimum(best, cost)
    return Poses(R, t, moving_rad, problem.expected.copy())


def _laid(model: Array, seen: Array, there: npt.NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Rigid transforms of model points (n, m, 3) onto seen ones and the sums of squares left."""
    w = there / there.sum(axis=1, keepdims=True)
    a, b = np.einsum("nm,nmi->ni", w, model), np.einsum("nm,nmi->ni", w, seen)
    A, B = model - a[:, None], seen - b[:, None]
    U, _, V = np.linalg.svd(np.einsum("nm,nmi,nmj->nij", w, B, A))
    flip = np.ones((len(U), 3))
    flip[:, 2] = np.linalg.det(U @ V)
    R = (U * flip[:, None, :]) @ V
    cost = (w[:, :, None] * (np.einsum("nij,nmj->nmi", R, A) - B) ** 2).sum(axis=(1, 2))
    return R, b - np.einsum("nij,nj->ni", R, a), cost
