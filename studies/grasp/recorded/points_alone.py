"""Where a hand is of which the wrist and the tips alone were recorded: the solver's pose. Pure.

The hand is the tables', scaled so that its straight fingers are as long as the recorded ones ever
reach from the wrist.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS, HandModel, default_hand, forward
from rhot.messages import HandPoint, HandPoints
from services.simulator.recorded_motion.recording import RecordedPoints
from services.solver.whole_hand.hand_tracker import HandTracker
from services.solver.whole_hand.landmarks import hand_landmarks
from services.solver.whole_hand.point_check import usable_points

# A reflecting ball on a glove: it is measured to 0.2 mm, and is 1 to 2 mm off the finger's end,
# another way in each posture.
MARKER_SIGMA_M = 0.0015
# The longest reach of recorded tips that is no slip of the measurement.
_REACH_PERCENTILE = 99.0
_STEPS_A_SECOND = 50.0
# Any stamp that is not 0.
_START_NS = 10**9


class SolvedHand(NamedTuple):
    """A hand at the frames `rows` (m,) of a recording."""

    model: HandModel
    rows: Array  # (m,) numbers
    wrist_m: Array  # (m, 3)
    rotations: Array  # (m, 3, 3)
    angles_rad: Array  # (m, 5, 4)


def solved_hand(points: RecordedPoints, advance: Callable[[], None]) -> SolvedHand | None:
    """At most 50 frames a second; None where no hand was found.

    advance is called for each frame.
    """
    model = default_hand(points.hand, _size(points))
    landmarks = hand_landmarks(model)
    tracker = HandTracker(model, landmarks)
    rows, wrists, rotations, angles = [], [], [], []
    last_s = -np.inf
    for row, time_s in enumerate(points.times_s.tolist()):
        if time_s - last_s < 0.999 / _STEPS_A_SECOND:
            continue
        last_s = time_s
        advance()
        message = _message(points, row)
        pose = tracker.track(message.stamp_ns, usable_points(message, landmarks))
        if pose is not None:
            rows.append(row)
            wrists.append(pose.position_m)
            rotations.append(pose.rotation)
            angles.append(pose.angles_rad)
    if not rows:
        return None
    return SolvedHand(
        model, np.array(rows), np.array(wrists), np.array(rotations), np.array(angles)
    )


def _size(points: RecordedPoints) -> float:
    """How large the hand is against the tables', from the reach of its fingers."""
    model = default_hand(points.hand)
    joints = forward(model, np.eye(3), np.zeros(3), np.zeros((5, 4)))[0]
    straight = [np.linalg.norm(joints[k]) for k in (10, 15, 20, 25)]
    reach = np.linalg.norm(points.points_m[:, 2:] - points.points_m[:, :1], axis=2)
    own = np.nanpercentile(reach, _REACH_PERCENTILE, axis=0)
    return float(np.clip(np.median(own / straight), 0.5, 1.5))


def _message(points: RecordedPoints, row: int) -> HandPoints:
    places = points.points_m[row]
    return HandPoints(
        hand=points.hand,
        seq=row,
        stamp_ns=_START_NS + round(float(points.times_s[row]) * 1e9),
        points=[
            HandPoint(
                name=name,
                position_m=(float(place[0]), float(place[1]), float(place[2])),
                sigma_m=(MARKER_SIGMA_M,) * 3,
                cameras=["left", "right"],
                source="measured",
            )
            for name, place in zip(BASIC_LANDMARKS, places, strict=True)
            if np.isfinite(place).all()
        ],
    )
