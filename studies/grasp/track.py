"""A recording of a finger as arrays over time; NaN where something was not measured. Pure.

What a frame leaves out is taken from what it has: angles and the tip's direction from the joints'
points, the direction from the sum of the angles. Why a recording is odd stands in the notes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from studies.grasp.recording import Angle, GraspFrame, GraspRecording, Joint

_JOINTS: tuple[Joint, ...] = get_args(Joint)
_ANGLES: tuple[Angle, ...] = get_args(Angle)
# rad; no joint of a finger bends further, but degrees written as radians do.
_LARGEST_ANGLE_RAD = 2.0 * np.pi
# rad; a distal phalanx points from a little above the base line (all joints hyperextended) to
# 290 deg below it. A direction read off two points is one of that turn.
_LOWEST_DIRECTION_RAD = np.deg2rad(-70.0)
# mm; the three phalanges of a child's little finger to a large man's middle finger, with room.
_SHORTEST_MM, _LONGEST_MM = 25.0, 160.0
# Fewer frames with a tip say nothing of a motion.
_MIN_FRAMES = 8


@dataclass(frozen=True, eq=False)
class FingerTrack:
    """The frames that measured anything, in the order of time."""

    times_s: Array  # (n,) increasing
    joints: Array  # (n, 4, 2) mcp, pip, dip, tip in the recording's unit, in the finger's plane
    angles_rad: Array  # (n, 3)
    direction_rad: Array  # (n,) of the distal phalanx against the base line
    sigma: Array  # (n,) of the tip, one standard deviation along each axis
    notes: list[str] = field(default_factory=list)

    @property
    def tip(self) -> Array:
        """The tip's path (n, 2)."""
        return self.joints[:, 3]

    @property
    def lengths(self) -> Array:
        """Measured phalanges of each frame, (n, 3)."""
        return np.linalg.norm(np.diff(self.joints, axis=1), axis=2)

    def columns(self) -> Array:
        """Everything that is interpolated in time, (n, 13): joints, angles, direction, sigma."""
        flat = self.joints.reshape(len(self.times_s), 8)
        return np.column_stack([flat, self.angles_rad, self.direction_rad, self.sigma])


def track_of_columns(times_s: Array, columns: Array) -> FingerTrack:
    """The reverse of FingerTrack.columns, (n, 13)."""
    joints = columns[:, :8].reshape(-1, 4, 2)
    return FingerTrack(times_s, joints, columns[:, 8:11], columns[:, 11], columns[:, 12])


def finger_track(recording: GraspRecording) -> FingerTrack:
    """Raises CaptureError where too few frames were measured, or angles are no radians."""
    who = f"{recording.subject} ({recording.source or recording.method})"
    frames = [frame for frame in recording.frames if _measured(frame)]
    if len(frames) < _MIN_FRAMES:
        raise CaptureError(
            f"{who}: {len(frames)} of {len(recording.frames)} frames have a finger; a motion needs"
            f" at least {_MIN_FRAMES}. Measure a longer piece of the video"
        )
    times = np.array([frame.time_s for frame in frames])
    order = np.argsort(times, kind="stable")
    measured = len(order)
    order = order[np.concatenate([[True], np.diff(times[order]) > 0.0])]
    frames = [frames[k] for k in order.tolist()]
    if len(frames) < _MIN_FRAMES:
        raise CaptureError(
            f"{who}: its {measured} frames have {len(frames)} different times; time_s must grow"
            " from frame to frame, in seconds"
        )
    joints, angles = _joints(frames), _angles(frames)
    largest = float(np.nanmax(np.abs(angles), initial=0.0))
    if largest > _LARGEST_ANGLE_RAD:
        raise CaptureError(
            f"{who}: an angle of {largest:.1f} rad; no joint bends further than"
            f" {_LARGEST_ANGLE_RAD:.1f} rad. Were degrees written as angles_rad?"
        )
    turns = _turns(joints)
    angles = np.where(np.isfinite(angles), angles, _angles_of_turns(turns))
    told = np.array(
        [np.nan if f.tip_direction_rad is None else f.tip_direction_rad for f in frames]
    )
    # Angles know how often the finger has curled round; a direction on its own does not.
    direction = angles.sum(axis=1)
    direction = np.where(np.isfinite(direction), direction, _in_turn(told))
    direction = np.where(np.isfinite(direction), direction, _in_turn(turns[:, 2]))
    sigma = np.array([frame.points_sigma.get("tip", np.nan) for frame in frames])
    notes = [] if len(frames) == measured else ["frames of the same time were left out"]
    return FingerTrack(times[order], joints, angles, direction, sigma, notes)


def finger_lengths(recording: GraspRecording, track: FingerTrack) -> tuple[Array | None, str]:
    """Fixed lengths (3,) of the phalanges in the recording's unit, and where they come from.

    None where neither the recording nor its joints tell.
    """
    if recording.lengths is not None and min(recording.lengths[:2]) + recording.lengths[2] > 0.0:
        return np.array(recording.lengths), "the recording's"
    measured = track.lengths
    if np.isfinite(measured).any(axis=0).all():
        return np.nanmedian(measured, axis=0), "medians of the measured joints"
    return None, "not measured"


def implausible(recording: GraspRecording, lengths: Array) -> str:
    """What is odd about a finger's lengths (3,) in mm, or nothing."""
    total = float(lengths.sum())
    if recording.unit == "px" or _SHORTEST_MM <= total <= _LONGEST_MM:
        return ""
    guess = ""
    for factor, unit in ((1e3, "metres"), (10.0, "centimetres"), (1e-3, "micrometres")):
        if _SHORTEST_MM <= total * factor <= _LONGEST_MM:
            guess = f"; {unit} written as mm?"
    return (
        f"its finger is {total:.3g} mm long, and fingers are {_SHORTEST_MM:g} to"
        f" {_LONGEST_MM:g} mm{guess}. Angles hold, lengths and distances do not"
    )


def _measured(frame: GraspFrame) -> bool:
    return frame.confidence > 0.0 and ("tip" in frame.points or bool(frame.angles_rad))


def _joints(frames: list[GraspFrame]) -> Array:
    none = (np.nan, np.nan)
    return np.array([[frame.points.get(joint, none) for joint in _JOINTS] for frame in frames])


def _angles(frames: list[GraspFrame]) -> Array:
    return np.array([[frame.angles_rad.get(name, np.nan) for name in _ANGLES] for frame in frames])


def _turns(joints: Array) -> Array:
    """Directions of the three phalanges against the base line, (n, 4, 2) -> (n, 3)."""
    bones = np.diff(joints, axis=1)
    return np.arctan2(bones[..., 1], bones[..., 0])


def _angles_of_turns(turns: Array) -> Array:
    """Each phalanx against the one before it, within half a turn; (n, 3) -> (n, 3)."""
    bends = np.diff(turns, axis=1, prepend=0.0)
    return (bends + np.pi) % (2.0 * np.pi) - np.pi


def _in_turn(direction: Array) -> Array:
    low = _LOWEST_DIRECTION_RAD
    return (direction - low) % (2.0 * np.pi) + low
