"""Recorded hands of $RHOT_DATA: as motions of six landmarks, and as hands with bones of their own.

Read by services/simulator/recorded_motion; shown to and fro where they are shorter than a case.
"""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np

from services.simulator.recorded_motion.before_cameras import RecordedMotion
from services.simulator.recorded_motion.bones import DrivenHand
from services.simulator.recorded_motion.playback import Playback
from services.simulator.recorded_motion.recording import RecordedPoints
from services.simulator.recorded_motion.scenes import load_motion
from services.simulator.scene.actors import PalmView, Travel, place_hand

# Middle of the cameras of SyntheticRig.
_MIDDLE_X_M = 0.0375
# How the cameras see the palm on the average.
_VIEW = PalmView(20.0, 0.0, 0.0)


def leap_hand(name: str) -> DrivenHand:
    """The hand of a Leap recording, with the bones that the sensor found.

    Raises CaptureError if the recording is not there.
    """
    driven = _loaded(f"leap/{name}.csv")
    assert isinstance(driven, DrivenHand)
    return driven


def leap_motion(name: str, distance_m: float = 0.5) -> RecordedMotion:
    """Wrist and tips of a Leap recording before SyntheticRig's cameras."""
    return _shown(leap_hand(name), distance_m)


def glove_motion(first: int, last: int, distance_m: float = 0.5) -> RecordedMotion:
    """Frames first..last (100 a second) of the Qualisys recording; NaN in its gaps."""
    whole = _loaded("qualisys/recording.tsv.gz")
    assert isinstance(whole, RecordedPoints)
    times_s = whole.times_s[first:last]
    part = RecordedPoints(whole.hand, times_s - times_s[0], whole.points_m[first:last])
    return _shown(part, distance_m)


@cache
def _loaded(name: str) -> DrivenHand | RecordedPoints:
    data = os.environ.get("RHOT_DATA", Path(__file__).parents[3] / "shared" / "data")
    return load_motion(Path(data) / "hand_motion" / name)


def _shown(recorded: DrivenHand | RecordedPoints, distance_m: float) -> RecordedMotion:
    middle = np.array([_MIDDLE_X_M, 0.0, distance_m])
    place = place_hand(np.eye(4), middle, _VIEW, Travel((0.0, 0.0, 0.0), 1.0))
    playback = Playback(float(recorded.times_s[-1]), to_and_fro=True)
    return RecordedMotion(recorded, playback, place.rotation, middle)
