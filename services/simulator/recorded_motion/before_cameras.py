"""Recorded motion before the cameras: the middle of the hand at a place, its palm turned to them.

A recording's own place and heading are those of its sensor. Here the middle of all its landmarks,
over all its time, comes to rest where a scene has the hand, and so does its mean orientation. Pure.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    vector_from_rotation,
)
from rhot.hand import BASIC_LANDMARKS
from services.simulator.hands.gestures import Gesture
from services.simulator.recorded_motion.bones import DrivenHand
from services.simulator.recorded_motion.leap_csv import palm_axes
from services.simulator.recorded_motion.playback import Curve, Playback
from services.simulator.recorded_motion.recording import RecordedPoints


class RecordedGesture:
    """A motion of hands/gestures.py: relative to the wrist at rest, `middle_m` (3,) from the
    middle of the hand there, in the axes of the wrist.
    """

    def __init__(self, driven: DrivenHand, playback: Playback, middle_m: Array) -> None:
        mean = _mean_rotation(driven.rotations)
        centre = driven.points().points_m.mean(axis=(0, 1))
        shift = (driven.wrist_m - centre) @ mean + middle_m
        turns = np.array([quaternion_from_rotation(mean.T @ R) for R in driven.rotations])
        # Of q and -q, the same rotation, the one next to the frame before.
        flips = np.sum(turns[1:] * turns[:-1], axis=1) < 0.0
        turns[1:] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)[:, None]
        samples = np.column_stack([turns, shift, driven.angles_rad.reshape(len(shift), 20)])
        self._curve = Curve(driven.times_s, samples)
        self._playback = playback

    def __call__(self, t_s: float) -> Gesture:
        """The hand at t_s; nothing that it does is involuntary."""
        values = self._curve(self._playback(np.array([t_s])))[0]
        turn = vector_from_rotation(rotation_from_quaternion(values[:4]))
        return Gesture(values[7:].reshape(5, 4), turn, values[4:7], calm=1.0, calm_digits=1.0)


class RecordedMotion:
    """Wrist and tips of a recording in the rig frame at any times: (n, 6, 3) at times (n,) or, one
    for each landmark, (n, 6); NaN where the recording does not know them.
    """

    def __init__(
        self,
        recorded: DrivenHand | RecordedPoints,
        playback: Playback,
        R_rig_from_wrist: Array,
        middle_m: Array,
        speed: float = 1.0,
    ) -> None:
        """R_rig_from_wrist (3, 3) is the mean orientation of the wrist frame, middle_m (3,) the
        middle of the hand, both in the rig frame. Of points alone the wrist frame is a guess.
        """
        if isinstance(recorded, DrivenHand):
            axes, recorded = recorded.rotations, recorded.points()
        else:
            axes = palm_of_points(recorded)
        centre = np.nanmean(recorded.points_m, axis=(0, 1))
        R_rig_from_recording = R_rig_from_wrist @ _mean_rotation(axes).T
        points = (recorded.points_m - centre) @ R_rig_from_recording.T + middle_m
        self._curves = [Curve(recorded.times_s, points[:, k]) for k in range(len(BASIC_LANDMARKS))]
        self._playback, self._speed = playback, speed

    def __call__(self, times_s: Array) -> Array:
        times = np.asarray(times_s, dtype=np.float64).reshape(len(times_s), -1)
        times = self._playback(self._speed * np.broadcast_to(times, (len(times), 6)))
        return np.stack([curve(times[:, k]) for k, curve in enumerate(self._curves)], axis=1)


def palm_of_points(recorded: RecordedPoints) -> Array:
    """Wrist axes (k, 3, 3) as far as wrist and tips tell them, of the frames that have all."""
    points = recorded.points_m[np.isfinite(recorded.points_m).all(axis=(1, 2))]
    wrist, _, index, middle, ring, little = np.moveaxis(points, 1, 0)
    side = 1.0 if recorded.hand == "right" else -1.0
    along = 0.25 * (index + middle + ring + little) - wrist
    return palm_axes(np.cross(along, side * (little - index)), along)


def _mean_rotation(rotations: Array) -> Array:
    """The rotation (3, 3) nearest to all of (n, 3, 3)."""
    u, _, vt = np.linalg.svd(rotations.sum(axis=0))
    u[:, 2] *= np.linalg.det(u @ vt)
    return np.asarray(u @ vt)
