"""Whether a guided recording shows what its exercises ask for. Pure."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import TIPS
from rhot.hand_exercises import EXERCISES, Exercise
from services.calibrator.hand.recording import GuidedRecording

# Least tip movement (m) against the wrist that tells an exercise from standing still: a bend of a
# quarter of the way. The thumb's tip moves a quarter of a finger's.
_MIN_MOVE_M, _MIN_THUMB_MOVE_M = 0.02, 0.25 * 0.02
# Of an exercise's frames, how many must show wrist and all tips for it to be used.
_MIN_FRAMES = 10


def missing_data(recording: GuidedRecording) -> list[str]:
    """What is missing, in words for the person; empty if every exercise can be used."""
    found = []
    for exercise in EXERCISES:
        points = recording.points.get(exercise.name)
        if points is None or len(points) == 0:
            found.append(f"{exercise.name}: nothing was recorded")
            continue
        seen = ~np.isnan(points[:, :, 0])
        if exercise.kind != "fist" and int(seen.all(axis=1).sum()) < _MIN_FRAMES:
            rarest = recording.names[int(seen.mean(axis=0).argmin())]
            percent = int(seen.mean(axis=0).min() * 100)
            found.append(
                f"{exercise.name}: {rarest} was measured in {percent} % of {len(points)} frames "
                "only"
            )
        elif exercise.digit >= 0 and not _moved(recording, exercise, points):
            tip = TIPS[exercise.digit].replace("_", " ")
            found.append(f"{exercise.name}: the {tip} did not move ({exercise.prompt})")
    return found


def _moved(recording: GuidedRecording, exercise: Exercise, points: Array) -> bool:
    """Whether the exercised tip moved against the wrist; False if it was never seen."""
    tip = recording.names.index(TIPS[exercise.digit])
    wrist = recording.names.index("wrist")
    reach = np.linalg.norm(points[:, tip] - points[:, wrist], axis=1)
    least = _MIN_MOVE_M if exercise.digit else _MIN_THUMB_MOVE_M
    return float(np.nanmax(reach) - np.nanmin(reach)) > least
