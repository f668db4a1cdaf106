"""Messages of a guided recording sorted into its exercises. Pure.

The exercises follow each other on a fixed schedule (rhot/hand_exercises.py). When they began is
found from which finger tip moves when, so that a person may be late, a recording may begin early,
and a simulated one may run in circles. Predicted points count as missing; a recording in which
nothing moves as asked is a CalibrationError.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS, TIPS, HandModel
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from rhot.messages import HandPoints

# Steps in which the beginning is searched, and how much of an exercise's ends is left out: nobody
# changes over in no time.
_STEP_S, _EDGE_S = 0.1, 0.2
# Share of all tips' movement that the asked tip must have, on average, for the beginning to be
# accepted; by chance it has 0.2.
_MIN_SHARE = 0.45
# A sigma of fusion below this says how it was filtered, not how well paint is known.
_MIN_SIGMA_M = 3e-4


@dataclass(frozen=True)
class GuidedRecording:
    """Frames of every exercise by name, in the rig frame; m landmarks named in names.

    Points (n, m, 3) m, NaN where a landmark was not measured, and their sigmas (n, m, 3) m.
    """

    names: tuple[str, ...]
    points: Mapping[str, Array]
    sigmas: Mapping[str, Array]


def sort_exercises(
    messages: Sequence[HandPoints], model: HandModel, *, start_s: float | None = None
) -> GuidedRecording:
    """Frames by exercise, in the frame of the messages.

    The exercises began start_s after the first message (None: found from the movement).

    Raises CalibrationError if wrist and finger tips were never measured together or no beginning
    fits.
    """
    names = measured_names(messages, model)
    points, sigmas = _arrays(messages, names)
    times = np.array([(message.stamp_ns - messages[0].stamp_ns) * 1e-9 for message in messages])
    if times[-1] < CYCLE_S - EXERCISE_S:
        raise CalibrationError(
            f"the exercises take {CYCLE_S:.0f} s, the recording lasts {times[-1]:.0f} s: follow "
            "them to the end, or use `rhot calibrate hand --free`, which needs no exercises"
        )
    if start_s is None:
        start_s = find_start(times, points, names)
    phase = (times - start_s) % CYCLE_S
    within = phase % EXERCISE_S
    inner = (within >= _EDGE_S) & (within <= EXERCISE_S - _EDGE_S)
    # One pass only: what comes before the beginning belongs to the last pass's end, if the
    # recording runs in circles.
    rows_of = {
        exercise.name: inner & ((phase // EXERCISE_S).astype(int) == number)
        for number, exercise in enumerate(EXERCISES)
    }
    return GuidedRecording(
        names,
        {name: points[rows] for name, rows in rows_of.items()},
        {name: sigmas[rows] for name, rows in rows_of.items()},
    )


def measured_names(messages: Sequence[HandPoints], model: HandModel) -> tuple[str, ...]:
    """The basic landmarks, and what else was measured and has paint in the model."""
    measured = {
        point.name for message in messages for point in message.points if point.source == "measured"
    }
    missing = [name for name in BASIC_LANDMARKS if name not in measured]
    if missing:
        raise CalibrationError(
            f"no measured {', '.join(missing)} in {len(messages)} messages: are they painted, and "
            "named in rig.toml?"
        )
    others = sorted(name for name in measured - set(BASIC_LANDMARKS) if name in model.paint)
    return (*BASIC_LANDMARKS, *others)


def find_start(times: Array, points: Array, names: Sequence[str]) -> float:
    """Seconds after the first frame at which the exercises began, from which tip moves when.

    times (n,) s, points (n, m, 3). Raises CalibrationError if no beginning fits.
    """
    tips = [names.index(name) for name in TIPS]
    reach = np.linalg.norm(points[:, tips] - points[:, [names.index("wrist")]], axis=2)  # (n, 5)
    best_s, best_share = 0.0, -1.0
    for start_s in np.arange(0.0, CYCLE_S, _STEP_S):
        number = (((times - start_s) % CYCLE_S) // EXERCISE_S).astype(int)
        share = np.mean(
            [
                _movement_share(reach[number == k], exercise.digit)
                for k, exercise in enumerate(EXERCISES)
                if exercise.digit >= 0
            ]
        )
        if share > best_share:
            best_s, best_share = float(start_s), float(share)
    if best_share < _MIN_SHARE:
        raise CalibrationError(
            f"the exercises cannot be told apart (the asked finger made {best_share:.0%} of the "
            f"movement, {_MIN_SHARE:.0%} is needed): bend only the asked one, in the guide's order "
            "and at its pace; `rhot calibrate hand --list` shows it"
        )
    return best_s


def _movement_share(reach: Array, digit: int) -> float:
    """The share of one tip in the variance of all tips' distances from the wrist (n, 5)."""
    if len(reach) < 2:
        return 0.0
    seen = [column[~np.isnan(column)] for column in reach.T]
    with np.errstate(invalid="ignore"):
        moved = np.array([np.var(column) if len(column) else 0.0 for column in seen])
    return float(moved[digit] / moved.sum()) if moved.sum() > 0.0 else 0.0


def _arrays(messages: Sequence[HandPoints], names: Sequence[str]) -> tuple[Array, Array]:
    """Points and sigmas, both (n, m, 3), NaN where a landmark was not measured."""
    points, sigmas = (np.full((len(messages), len(names), 3), np.nan) for _ in range(2))
    for row, message in enumerate(messages):
        for point in message.points:
            if point.name not in names or point.source != "measured":
                continue
            if np.all(np.isfinite([*point.position_m, *point.sigma_m])):
                column = names.index(point.name)
                points[row, column] = point.position_m
                sigmas[row, column] = np.maximum(point.sigma_m, _MIN_SIGMA_M)
    return points, sigmas
