"""Frames of free motion: which of them to use, and why a recording cannot be used. Pure.

Every reason is a CalibrationError that says what was wrong, what is needed and what to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS, TIPS, HandModel, forward, landmark_point
from rhot.messages import HandPoints
from services.calibrator.hand.free_motion.poses import Bools, Frames, Rows
from services.calibrator.hand.recording import measured_names

# Frames that are used: 2 to 5 s of work. As many frames evenly in time gave 4.9 mm where these, as
# unlike as can be, gave 3.5 (tuning half, scenes with random motion).
FRAMES = 72
# How long wrist and all tips must have been seen together: below, and what is good.
MIN_SECONDS, GOOD_SECONDS = 15.0, 60.0
# What skin moves over bone and paint is uneven, beside the points' own noise.
_SKIN_M = 1e-3
# A tip that comes no nearer to the wrist by this share of its reach was held.
_MIN_BEND = 0.15
# Sizes that no hand has, against the tables'.
_MIN_SCALE, _MAX_SCALE = 0.5, 1.6
# Frames farther apart than this count as this much time: a hand that was away was not seen.
MAX_STEP_S = 0.2
# A distance between two landmarks that differs from its neighbours' median in time by so much is
# an error of measurement.
_MAX_JUMP_M = 0.012


class Seen(NamedTuple):
    """The frames of a recording that show wrist and all tips."""

    names: tuple[str, ...]
    frames: Frames
    seconds: float  # for how long they were shown
    of_seconds: float  # of how long a recording
    scale: float  # about the size against the tables'
    not_bent: tuple[str, ...]  # digits that were held


def seen_frames(messages: Sequence[HandPoints], table: HandModel) -> Seen:
    """What a recording of one hand shows. Raises CalibrationError if that is too little."""
    names = measured_names(messages, table)
    frames = _frames(messages, names)
    stamps_s = 1e-9 * np.array([m.stamp_ns - messages[0].stamp_ns for m in messages])
    if np.any(np.diff(stamps_s) < 0.0):
        raise CalibrationError(
            "stamps run backwards: two recordings in one, or two hands under one name; give one "
            "recording of one hand"
        )
    basic = frames.weights[:, : len(BASIC_LANDMARKS), 0, 0] > 0.0
    whole = np.asarray(basic.all(axis=1))
    steps = np.minimum(np.diff(stamps_s, append=stamps_s[-1]), MAX_STEP_S)
    seconds, of_seconds = float(steps[whole].sum()), float(stamps_s[-1])
    if seconds < MIN_SECONDS:
        rarest = BASIC_LANDMARKS[int(basic.mean(axis=0).argmin())].replace("_", " ")
        raise CalibrationError(
            f"wrist and all tips were seen together for {seconds:.0f} s (of {of_seconds:.0f} s; "
            f"least often the {rarest}: {basic.mean(axis=0).min():.0%}); "
            f"{MIN_SECONDS:.0f} s are needed, {GOOD_SECONDS:.0f} s are good: move the hand in view "
            "of two cameras, open, fist, spread, pinch, turned"
        )
    frames = frames.take(whole)
    frames = frames.take(_steady(frames))
    reach = np.linalg.norm(frames.points[:, 1 : len(TIPS) + 1] - frames.points[:, :1], axis=2)
    scale = _scale(reach, table)
    held = fingers_held(reach)
    if len(held) == len(TIPS) - 1:
        raise CalibrationError(
            f"the hand was held still: in {seconds:.0f} s no finger tip came nearer to the wrist "
            f"by more than {_MIN_BEND:.0%}; open and close it, bend the fingers together and one "
            "by one"
        )
    return Seen(names, frames.take(_diverse(frames)), seconds, of_seconds, scale, held)


def fingers_held(reach: Array) -> tuple[str, ...]:
    """Fingers that were never bent, by how far tips (n, 5) were from the wrist, m.

    Never the thumb: its tip stays as far from the wrist.
    """
    near, far = np.percentile(reach[:, 1:], (2.0, 98.0), axis=0)
    held = (far - near) / far < _MIN_BEND
    return tuple(
        tip.removesuffix("_tip") for tip, still in zip(TIPS[1:], held, strict=True) if still
    )


def _frames(messages: Sequence[HandPoints], names: Sequence[str]) -> Frames:
    """Points and their information, 0 where a landmark was not measured."""
    points = np.zeros((len(messages), len(names), 3))
    weights = np.zeros((len(messages), len(names), 3, 3))
    column = {name: index for index, name in enumerate(names)}
    upper = np.triu_indices(3)
    for row, message in enumerate(messages):
        for point in message.points:
            if point.source != "measured" or point.name not in column:
                continue
            if not np.all(np.isfinite([*point.position_m, *point.sigma_m])):
                continue
            covariance = np.diag(np.square(point.sigma_m))
            if point.covariance_m2 is not None:
                covariance[upper] = point.covariance_m2
                covariance.T[upper] = point.covariance_m2
            points[row, column[point.name]] = point.position_m
            weights[row, column[point.name]] = np.linalg.inv(covariance + _SKIN_M**2 * np.eye(3))
    return Frames(points, weights)


def _scale(reach: Array, table: HandModel) -> float:
    """About the size of the hand, from how far its finger tips (n, 5) get from the wrist."""
    joints = forward(table, np.eye(3), np.zeros(3), np.zeros((5, 4)))
    wrist, *tips = (landmark_point(table, name, *joints) for name in BASIC_LANDMARKS)
    straight = np.linalg.norm(np.array(tips) - wrist, axis=1)
    scale = float(np.mean(np.percentile(reach, 98.0, axis=0)[1:] / straight[1:]))
    if not _MIN_SCALE <= scale <= _MAX_SCALE:
        longest = float(np.percentile(reach, 98.0, axis=0).max())
        raise CalibrationError(
            f"finger tips get {longest:.3g} m away from the wrist, {scale:.2f} times an adult's: "
            "are points in metres, is the square of the calibration board right (--square), and "
            "are the markers of rig.toml this hand's?"
        )
    return scale


def _distances(points: Array) -> Array:
    """Between all pairs of wrist and tips: what does not depend on where the hand is."""
    a, b = np.triu_indices(len(BASIC_LANDMARKS), 1)
    return np.asarray(np.linalg.norm(points[:, a] - points[:, b], axis=2))


def _steady(frames: Frames) -> Bools:
    """Which frames are like their neighbours in time."""
    distances = _distances(frames.points)
    around = np.stack([np.roll(distances, shift, axis=0) for shift in (-2, -1, 0, 1, 2)])
    jump = np.abs(distances - np.median(around, axis=0)).max(axis=1)
    return np.asarray(jump < _MAX_JUMP_M)


def _diverse(frames: Frames) -> Rows:
    """Rows of up to FRAMES frames, each as unlike the others as can be (farthest point first)."""
    distances = _distances(frames.points)
    rows = [int(distances.sum(axis=1).argmax())]
    apart = np.linalg.norm(distances - distances[rows[0]], axis=1)
    while len(rows) < min(FRAMES, len(distances)):
        rows.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(distances - distances[rows[-1]], axis=1))
    return np.array(sorted(rows))
