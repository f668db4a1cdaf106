"""From the frames of a guided recording to the parameters of a hand. Pure and deterministic.

Too little data of an exercise is a CalibrationError that names the exercise and what was wrong
with it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from rhot.hand import TIPS, HandModel, default_hand, forward, landmark_point
from rhot.hand_exercises import EXERCISES
from services.calibrator.hand.adjust import Adjustment, adjust
from services.calibrator.hand.checks import missing_data
from services.calibrator.hand.hand_parameters import HandParameters
from services.calibrator.hand.initial_poses import initial_poses
from services.calibrator.hand.problem import Problem
from services.calibrator.hand.recording import GuidedRecording
from services.calibrator.hand.segments import exercise_segment

# Frames of each exercise that are used. More are no better: what is wrong with them (held fingers
# that twitch, neighbours that follow) is the same in all. On four simulated hands the solver's
# flexion error was 1.47 times that with true bones at 30, 1.31 at 12.
FRAMES = 12
# What a held finger twitches, and skin moves over bone, beside the measurement's own noise: 1.47
# times at 1 mm, 1.31 at 2 mm; on six other hands orientation 1.2 times at 2 mm, 1.1 at 3 mm.
_TWITCH_M = 3e-3
# Sizes that no hand has, against the tables'.
_MIN_SCALE, _MAX_SCALE = 0.4, 1.6


def fit_hand(
    recording: GuidedRecording,
    table: HandModel,
    lengths_m: Mapping[tuple[int, int], float] | None = None,
) -> tuple[Problem, Adjustment]:
    """The hand of a recording; table gives the proportions, lengths_m what was measured by hand:
    (digit, bone) -> metres.

    Raises CalibrationError saying which exercise cannot be used and why.
    """
    missing = missing_data(recording)
    if missing:
        raise CalibrationError("the recording does not determine the hand: " + "; ".join(missing))
    model = default_hand(table.hand, _scale(recording, table))
    parameters = HandParameters(model, recording.names, lengths_m)
    segments, points, sigmas = [], [], []
    for exercise in EXERCISES:
        # All fingers at once show no bones.
        if exercise.kind == "fist":
            continue
        rows = _chosen_frames(recording.points[exercise.name])
        points.append(recording.points[exercise.name][rows])
        sigmas.append(recording.sigmas[exercise.name][rows])
        segments.append(exercise_segment(exercise, len(rows)))
    all_points = np.concatenate(points)
    seen = ~np.isnan(all_points)
    weights = np.where(seen, 1.0 / (np.concatenate(sigmas) ** 2 + _TWITCH_M**2), 0.0)
    known_points = np.where(seen, all_points, 0.0)
    problem = Problem(parameters, known_points, np.nan_to_num(weights), tuple(segments))
    x = np.zeros(parameters.unknowns)
    return problem, adjust(problem, x, initial_poses(problem, x))


def _chosen_frames(points: Array) -> npt.NDArray[np.int64]:
    """Rows of up to FRAMES frames, evenly over those that show everything."""
    whole = np.nonzero(~np.isnan(points).any(axis=(1, 2)))[0]
    spread = np.linspace(0, len(whole) - 1, min(FRAMES, len(whole)))
    return whole[np.unique(spread.round().astype(np.int64))]


def _scale(recording: GuidedRecording, table: HandModel) -> float:
    """Size of the hand against the tables' from the open hand: wrist marker to finger tips."""
    joints = forward(default_hand(table.hand), np.eye(3), np.zeros(3), np.zeros((5, 4)))
    expected = {name: landmark_point(table, name, *joints) for name in recording.names}
    points = recording.points["open"]
    wrist = points[:, recording.names.index("wrist")]
    ratios = []
    for tip in TIPS[1:]:
        reach = np.linalg.norm(points[:, recording.names.index(tip)] - wrist, axis=1)
        expected_reach = np.linalg.norm(expected[tip] - expected["wrist"])
        ratios.append(np.nanmedian(reach) / expected_reach)
    scale = float(np.mean(ratios))
    if not _MIN_SCALE <= scale <= _MAX_SCALE:
        raise CalibrationError(
            f"the open hand is {scale:.2f} times the size of an adult's: are units and markers of "
            "rig.toml right?"
        )
    return scale
