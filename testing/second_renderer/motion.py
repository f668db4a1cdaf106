"""Hands that move: the joints of Leap recordings, played back smoothly and carried about. Pure.

Read from the sensor's own joints, without any hand model of rhot: palm, and five chains of four
joints. Millimetres become metres; everything else is in the rig frame (x right, y down, z away).
"""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
DIGITS = ("thumb", "index", "middle", "ring", "pinky")
_JOINTS = ("mcp", "pip", "dip", "tip")
# The wrist lies so far behind and above the middle of the palm, against the length of the middle
# finger's first bone: knuckles are then 95 mm from the wrist of an adult, as anatomy tables say.
_WRIST_BEHIND, _WRIST_ABOVE = 1.7, 0.16
# How fast flapping turns round: tanh of so many times a sine.
_SHARP = 2.5


class Bones(NamedTuple):
    """Where a hand's bones are at n instants: palm's axes are side, up (out of its back), back."""

    wrist: Array  # (n, 3)
    axes: Array  # (n, 3, 3), columns x (right), y (out of the back), z (towards the arm)
    joints: Array  # (n, 5, 4, 3)


@dataclass(frozen=True)
class Carried:
    """What a hand does besides its recording.

    kind: roll and wait turn it about the forearm, flap about the wrist's x axis, drift carries it
    about; degrees (drift: mm) to either side, hz times a second.
    """

    kind: Literal["", "roll", "wait", "flap", "drift"] = ""
    size: float = 0.0
    hz: float = 0.5


@dataclass(frozen=True)
class Play:
    """A recording and how it is shown.

    speed: against the recording's at its fastest (the way to and fro is a cosine); begin, end:
    which share of it. scale: how much larger the hand is. distance_m, tilt_deg (fingers towards the
    cameras), yaw_deg, roll_deg: where it is on average; at: its middle, x and y in m.
    """

    recording: str
    carried: Carried = Carried()
    speed: float = 1.0
    begin: float = 0.0
    end: float = 1.0
    scale: float = 1.0
    distance_m: float = 0.45
    tilt_deg: float = 25.0
    yaw_deg: float = 0.0
    roll_deg: float = 0.0
    at: tuple[float, float] = (0.04, 0.03)

    def bones(self, times_s: Array) -> Bones:
        """The hand at n instants."""
        shown_s = self._recorded_s(times_s)
        wrist_of, axes_of, joints_of = _recorded(self.recording)
        wrist, joints = wrist_of(shown_s), joints_of(shown_s)
        axes = _orthonormal(axes_of(shown_s))
        turn, shift = self._placed()
        own, moved = self._carry(times_s)
        middle = self._middle()

        def place(points: Array) -> Array:
            local = self.scale * (points - middle)
            at = np.einsum("ij,n...j->n...i", turn, local)
            at = np.einsum("nij,n...j->n...i", own, at)
            return at + (shift + moved).reshape(len(at), *(1,) * (at.ndim - 2), 3)

        return Bones(place(wrist), own @ turn @ axes, place(joints))

    def _recorded_s(self, times_s: Array) -> Array:
        wrist_of, _, _ = _recorded(self.recording)
        whole_s = float(wrist_of.x[-1])
        first_s, last_s = self.begin * whole_s, self.end * whole_s
        half_s = 0.5 * (last_s - first_s)
        omega = self.speed / max(half_s, 1e-9)
        return np.asarray(first_s + half_s * (1.0 - np.cos(omega * times_s)))

    def _middle(self) -> Array:
        wrist_of, _, joints_of = _recorded(self.recording)
        shown_s = self._recorded_s(np.linspace(0.0, 10.0, 60))
        return np.asarray(0.5 * (wrist_of(shown_s) + joints_of(shown_s)[:, 2, 3]).mean(axis=0))

    def _placed(self) -> tuple[Array, Array]:
        """Turn (3, 3) from the recording to the rig, and where its middle comes to lie."""
        _, axes_of, _ = _recorded(self.recording)
        mean = _orthonormal(
            axes_of(self._recorded_s(np.linspace(0.0, 10.0, 60))).mean(axis=0)[None]
        )[0]
        # Palm to the cameras, fingers up: columns are where right, back of the hand and arm go.
        facing = np.stack([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]], axis=1)
        seen = Rotation.from_euler(
            "zyx", [self.roll_deg, self.yaw_deg, self.tilt_deg], degrees=True
        ).as_matrix()
        return seen @ facing @ mean.T, np.array([*self.at, self.distance_m])

    def _carry(self, times_s: Array) -> tuple[Array, Array]:
        """Turns (n, 3, 3) about the middle, and shifts (n, 3)."""
        kind, size, phase = (
            self.carried.kind,
            self.carried.size,
            2 * np.pi * self.carried.hz * times_s,
        )
        shift = np.zeros((len(times_s), 3))
        way = np.sin(phase)
        if kind == "wait":
            # Holds still at either side.
            way = np.clip(1.6 * np.sin(phase), -1.0, 1.0)
            way = np.sin(0.5 * np.pi * way)
        if kind == "flap":
            way = np.tanh(_SHARP * np.sin(phase)) / np.tanh(_SHARP)
        if kind == "drift":
            shift = (
                1e-3
                * size
                * np.stack(
                    [np.sin(phase), 0.5 * np.sin(0.73 * phase + 1.0), 0.8 * np.sin(0.61 * phase)],
                    axis=1,
                )
            )
        vector = np.zeros((len(times_s), 3))
        if kind in ("roll", "wait"):
            vector[:, 1] = np.deg2rad(size) * way
        if kind == "flap":
            vector[:, 0] = np.deg2rad(size) * way
        return Rotation.from_rotvec(vector).as_matrix(), shift


@cache
def _recorded(name: str) -> tuple[CubicSpline, CubicSpline, CubicSpline]:
    """Wrist, palm's axes and joints of a recording over its time (s)."""
    data = os.environ.get("RHOT_DATA", Path(__file__).parents[3] / "shared" / "data")
    path = Path(data) / "hand_motion" / "leap" / f"{name}.csv"
    with path.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["hand_type"] == "right"]
    times_s = np.array([float(row["timestamp_us"]) for row in rows]) * 1e-6
    keep = np.concatenate([[True], np.diff(times_s) > 1e-4])
    times_s = times_s[keep] - times_s[0]

    def points(prefix: str) -> Array:
        return np.array([[float(row[f"{prefix}_{axis}"]) for axis in "xyz"] for row in rows])[keep]

    joints = 1e-3 * np.array([[points(f"{d}_{j}") for j in _JOINTS] for d in DIGITS])
    joints = joints.transpose(2, 0, 1, 3)  # (n, 5, 4, 3)
    z, y = -points("direction"), -points("normal")
    axes = _orthonormal(np.stack([np.cross(y, z), y, z], axis=2))
    first = np.linalg.norm(joints[:, 2, 1] - joints[:, 2, 0], axis=1).mean()
    away = _WRIST_BEHIND * axes[:, :, 2] + _WRIST_ABOVE * axes[:, :, 1]
    wrist = 1e-3 * points("palm") + first * away
    return CubicSpline(times_s, wrist), CubicSpline(times_s, axes), CubicSpline(times_s, joints)


def _orthonormal(axes: Array) -> Array:
    """The nearest rotations to matrices (n, 3, 3)."""
    u, _, v = np.linalg.svd(axes)
    return np.asarray(u @ v)
