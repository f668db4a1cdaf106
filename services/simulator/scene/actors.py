"""Hands and objects of a scene as functions of time, in the rig frame. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.files.calibration import ObjectPlace
from rhot.geometry.transforms import (
    Array,
    inverse,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_x,
    rotation_y,
    transform,
    vector_from_rotation,
)
from rhot.hand import HandModel, HandName
from services.simulator.scene.gestures import TAU, Motion, Unrest
from services.simulator.scene.hand_kinematics import Skeleton

# The middle of an open hand in the wrist frame: at its longest it reaches 0.19 m beyond the wrist.
_MIDDLE_M = np.array([0.0, 0.0, -0.09])
# Forearm against hand: a hand tilted back by some angle has its wrist extended by this share of it.
_EXTENSION = 0.6
# Two hands stand this far apart, middle to middle.
_HANDS_APART_M = 0.23
# A held handle lies across the palm, under the proximal phalanges; axis of the object = x of the
# hand.
GRIP_M = np.array([0.0, -0.036, -0.104])


@dataclass(frozen=True, eq=False)
class HandState:
    """One hand at one instant: wrist and forearm in the rig frame, angles (5, 4) rad; grip 0..1."""

    wrist_rotation: Array  # (3, 3)
    wrist_m: Array  # (3,)
    arm_rotation: Array  # (3, 3)
    angles_rad: Array  # (5, 4)
    grip: float

    @property
    def T_rig_from_wrist(self) -> Array:  # noqa: N802 - frames cancel by name
        return transform(self.wrist_rotation, self.wrist_m)


@dataclass(frozen=True, eq=False)
class Stage:
    """Where a hand rests and how it travels, in the rig frame.

    The axes of `travel_m` are the first camera's.
    """

    rotation: Array  # (3, 3)
    wrist_m: Array  # (3,)
    arm_rotation: Array  # (3, 3)
    travel_axes: Array  # (3, 3)
    travel_m: Array  # (3,)
    travel_hz: float


@dataclass(frozen=True, eq=False)
class Hand:
    """One hand of the scene. landmarks maps painted landmarks to colours."""

    name: HandName
    model: HandModel
    skeleton: Skeleton
    landmarks: dict[str, str]
    motion: Motion
    unrest: Unrest
    stage: Stage
    speed: float

    def at(self, t_s: float) -> HandState:
        """The hand at t_s seconds of the scene."""
        gesture = self.motion(self.speed * t_s)
        turn, shift = self.unrest(t_s)
        stage = self.stage
        phase = TAU * stage.travel_hz * self.speed * t_s * np.array([1.0, 0.77, 0.61])
        travel = stage.travel_axes @ (stage.travel_m * np.sin(phase))
        rotation = (
            stage.rotation @ rotation_from_vector(gesture.turn_rad) @ rotation_from_vector(turn)
        )
        wrist = stage.wrist_m + travel + stage.rotation @ (gesture.shift_m + shift)
        angles = self.unrest.fingers(t_s, gesture.angles_rad, self.model)
        return HandState(rotation, wrist, stage.arm_rotation, angles, gesture.grip)

    def joints(self, state: HandState) -> tuple[Array, Array]:
        """All joints in the rig frame: positions (26, 3), rotations (26, 3, 3)."""
        return self.skeleton.joints(state.wrist_rotation, state.wrist_m, state.angles_rad)


@dataclass(frozen=True, eq=False)
class Thing:
    """An object: where it rests, and the hand that takes it, if any."""

    name: str
    serial: str
    T_rig_from_rest: Array  # (4, 4)
    place: ObjectPlace
    holder: HandName | None
    T_wrist_from_held: Array  # (4, 4)

    @property
    def T_object_from_tracker(self) -> Array:  # noqa: N802
        return inverse(
            transform(rotation_from_quaternion(self.place.orientation_wxyz), self.place.offset_m)
        )

    def at(self, hands: dict[HandName, HandState]) -> Array:
        """T_rig_from_object (4, 4) given the hands of the same instant.

        Moves from rest to held without a jump.
        """
        state = hands.get(self.holder) if self.holder else None
        if state is None or state.grip <= 0.0:
            return self.T_rig_from_rest
        T_held = state.T_rig_from_wrist @ self.T_wrist_from_held
        delta = self.T_rig_from_rest[:3, :3].T @ T_held[:3, :3]
        rotation = self.T_rig_from_rest[:3, :3] @ rotation_from_vector(
            state.grip * vector_from_rotation(delta)
        )
        return transform(
            rotation, (1.0 - state.grip) * self.T_rig_from_rest[:3, 3] + state.grip * T_held[:3, 3]
        )


def stage_of(
    T_rig_from_view: Array,
    middle_m: Array,
    tilt_deg: float,
    yaw_deg: float,
    roll_deg: float,
    travel_m: tuple[float, float, float],
    travel_hz: float,
) -> Stage:
    """A hand with its palm towards the first camera and its fingers up.

    T_rig_from_view places the first camera, middle_m (3,) is the middle of the hand in its frame.
    Tilted by 0 deg the palm faces the camera; more tilt lets the camera look from the wrist's side.
    """
    tilt, yaw, roll = np.deg2rad([tilt_deg, yaw_deg, roll_deg])
    # Columns: the wrist's x, y (back of the hand), z (away from the fingers) in the camera's frame.
    upright = np.array(
        [[-1.0, 0.0, 0.0], [0.0, np.sin(tilt), np.cos(tilt)], [0.0, np.cos(tilt), -np.sin(tilt)]]
    )
    spin = np.array(
        [[np.cos(roll), -np.sin(roll), 0.0], [np.sin(roll), np.cos(roll), 0.0], [0.0, 0.0, 1.0]]
    )
    R_view = spin @ rotation_y(yaw) @ upright
    axes = T_rig_from_view[:3, :3]
    rotation = axes @ R_view
    wrist = T_rig_from_view[:3, 3] + axes @ (middle_m - R_view @ _MIDDLE_M)
    arm = rotation @ rotation_x(-_EXTENSION * tilt)
    return Stage(rotation, wrist, arm, axes, np.array(travel_m), travel_hz)


def beside(hand: HandName, hands: int) -> float:
    """How far right of the middle a hand stands, m: as seen from the cameras that face the palms."""
    if hands < 2:
        return 0.0
    return -0.5 * _HANDS_APART_M if hand == "right" else 0.5 * _HANDS_APART_M
