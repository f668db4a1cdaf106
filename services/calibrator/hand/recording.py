"""Messages of a guided recording sorted into its exercises. Pure.

The exercises follow each other at a fixed pace (rhot/hand_exercises.py); when they began is found
from which finger tip moves when, so that a person may be late, a recording may begin early, and a
simulated one may run in circles. Predicted points count as missing; a recording in which nothing
moves as asked is a CalibrationError.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS, TIPS, HandModel
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from rhot.messages import HandPoints
from services.calibrator.hand.fit import Recording

# Steps in which the beginning is looked for, and how much of an exercise's ends is left out: nobody
# changes over in no time.
_STEP_S, _EDGE_S = 0.1, 0.2
# Share of all tips' movement that the asked tip must have, on average, for the beginning to be
# believed; by chance it has 0.2.
_LEAST_SHARE = 0.45
# A sigma of fusion below this says how it was filtered, not how well paint is known.
_LEAST_SIGMA_M = 3e-4


def recording_of(
    messages: Sequence[HandPoints], model: HandModel, *, start_s: float | None = None
) -> Recording:
    """Frames by exercise, in the frame of the messages; start_s after the first one the exercises
    began (None: it is looked for).

    Raises CalibrationError if wrist and finger tips were never seen together or no beginning fits.
    """
    seen = {
        point.name for message in messages for point in message.points if point.source == "measured"
    }
    missing = [name for name in BASIC_LANDMARKS if name not in seen]
    if missing:
        raise CalibrationError(
            f"no measured {', '.join(missing)} in {len(messages)} messages: are they painted, and named in rig.toml?"
        )
    names = (
        *BASIC_LANDMARKS,
        *sorted(name for name in seen - set(BASIC_LANDMARKS) if name in model.paint),
    )
    points, sigmas = _arrays(messages, names)
    times = np.array([(message.stamp_ns - messages[0].stamp_ns) * 1e-9 for message in messages])
    if start_s is None:
        start_s = beginning(times, points, names)
    phase = (times - start_s) % CYCLE_S
    within = phase % EXERCISE_S
    inner = (within >= _EDGE_S) & (within <= EXERCISE_S - _EDGE_S)
    # One pass only: what comes before the beginning belongs to the last pass's end, if the
    # recording runs in circles.
    of = {
        exercise.name: inner & ((phase // EXERCISE_S).astype(int) == number)
        for number, exercise in enumerate(EXERCISES)
    }
    return Recording(
        names,
        {name: points[rows] for name, rows in of.items()},
        {name: sigmas[rows] for name, rows in of.items()},
    )


def beginning(times: Array, points: Array, names: Sequence[str]) -> float:
    """Seconds after the first frame at which the exercises began, found from which tip moves when."""
    tips = [names.index(name) for name in TIPS]
    far = np.linalg.norm(points[:, tips] - points[:, [names.index("wrist")]], axis=2)
    best, share = 0.0, -1.0
    for start in np.arange(0.0, CYCLE_S, _STEP_S):
        number = (((times - start) % CYCLE_S) // EXERCISE_S).astype(int)
        shares = [
            _share(far[number == k], exercise.digit)
            for k, exercise in enumerate(EXERCISES)
            if exercise.digit >= 0
        ]
        if np.mean(shares) > share:
            best, share = float(start), float(np.mean(shares))
    if share < _LEAST_SHARE:
        raise CalibrationError(
            f"the exercises cannot be told apart (the asked finger made {share:.0%} of the movement, {_LEAST_SHARE:.0%} is needed): "
            "bend only the asked one, in the guide's order and at its pace; `rhot calibrate hand --list` shows it"
        )
    return best


def _share(far: Array, digit: int) -> float:
    """How much of all tips' movement is that of one."""
    if len(far) < 2:
        return 0.0
    with np.errstate(invalid="ignore"):
        moved = np.array(
            [
                np.var(column[~np.isnan(column)]) if np.any(~np.isnan(column)) else 0.0
                for column in far.T
            ]
        )
    return float(moved[digit] / moved.sum()) if moved.sum() > 0.0 else 0.0


def _arrays(messages: Sequence[HandPoints], names: Sequence[str]) -> tuple[Array, Array]:
    points, sigmas = (np.full((len(messages), len(names), 3), np.nan) for _ in range(2))
    for row, message in enumerate(messages):
        for point in message.points:
            if (
                point.name in names
                and point.source == "measured"
                and np.all(np.isfinite([*point.position_m, *point.sigma_m]))
            ):
                points[row, names.index(point.name)] = point.position_m
                sigmas[row, names.index(point.name)] = np.maximum(point.sigma_m, _LEAST_SIGMA_M)
    return points, sigmas
