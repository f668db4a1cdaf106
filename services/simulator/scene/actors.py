"""The hands and objects of a scene as functions of time, in the rig frame. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.files.calibration import ObjectPlace
from rhot.files.rig_tables import ObjectTable
from rhot.geometry.camera import Camera
from rhot.geometry.solids import Solid
from rhot.geometry.transforms import (
    Array,
    inverse,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_x,
    rotation_y,
    rotation_z,
    transform,
    vector_from_rotation,
)
from rhot.hand import HandModel, HandName
from services.simulator.hands.gestures import TAU, Motion
from services.simulator.hands.hand_kinematics import Skeleton
from services.simulator.hands.involuntary_motion import InvoluntaryMotion
from services.simulator.scene.sweep import Sweep

# The middle of an open hand in the wrist frame: at its longest it reaches 0.19 m beyond the wrist.
MIDDLE_M = np.array([0.0, 0.0, -0.09])
# A hand tilted back by some angle has its wrist extended by this share of it; the rest is the
# forearm's.
_EXTENSION = 0.6
# Along the axes of travel the hand moves at frequencies in these ratios, so that its path does not
# repeat soon.
_TRAVEL_RATIOS = np.array([1.0, 0.77, 0.61])
# Distance of two hands, middle to middle.
_HANDS_APART_M = 0.23
# Middle of a held object in the wrist frame: it lies across the palm, under the proximal phalanges,
# its axis along x of the hand.
GRIP_M = np.array([0.0, -0.036, -0.104])


@dataclass(frozen=True, eq=False)
class HandState:
    """One hand at one instant: wrist and forearm in the rig frame.

    grip is 0 while the hand is empty, 1 while it holds an object.
    """

    wrist_rotation: Array  # (3, 3)
    wrist_m: Array  # (3,)
    arm_rotation: Array  # (3, 3)
    angles_rad: Array  # (5, 4) in the order of DIGITS and DIGIT_ANGLES
    grip: float

    @property
    def T_rig_from_wrist(self) -> Array:  # noqa: N802 - frames cancel by name
        return transform(self.wrist_rotation, self.wrist_m)


class PalmView(NamedTuple):
    """How the cameras see a hand: angles by which the palm is turned away from the first camera.

    Tilted by 0 deg the palm faces the camera; more tilt lets the camera look from the wrist's side.
    """

    tilt_deg: float
    yaw_deg: float
    roll_deg: float


class Travel(NamedTuple):
    """How a hand moves about as a whole: amplitudes along x, y, z, and frequency of the first."""

    amplitude_m: tuple[float, float, float]
    hz: float


@dataclass(frozen=True, eq=False)
class HandPlacement:
    """The resting pose of a hand in the rig frame, and how it travels about it."""

    rotation: Array  # (3, 3)
    wrist_m: Array  # (3,)
    arm_rotation: Array  # (3, 3)
    travel_axes: Array  # (3, 3) columns: the first camera's axes
    travel_m: Array  # (3,)
    travel_hz: float


@dataclass(frozen=True, eq=False)
class Hand:
    """One hand of the scene; landmarks maps painted landmarks to colours."""

    name: HandName
    model: HandModel
    skeleton: Skeleton
    landmarks: dict[str, str]
    motion: Motion
    involuntary: InvoluntaryMotion
    placement: HandPlacement
    speed: float

    def state_at(self, t_s: float) -> HandState:
        """The hand at t_s seconds of the scene."""
        gesture = self.motion(self.speed * t_s)
        turn, shift = (1.0 - gesture.calm) * np.array(self.involuntary(t_s))
        rest = self.placement
        phase = TAU * rest.travel_hz * self.speed * t_s * _TRAVEL_RATIOS
        travel = rest.travel_axes @ (rest.travel_m * np.sin(phase))
        rotation = (
            rest.rotation @ rotation_from_vector(gesture.turn_rad) @ rotation_from_vector(turn)
        )
        wrist = rest.wrist_m + travel + rest.rotation @ (gesture.shift_m + shift)
        meant = gesture.angles_rad
        restless = self.involuntary.fingers(t_s, meant, self.model)
        angles = restless + gesture.calm_digits * (meant - restless)
        return HandState(rotation, wrist, rest.arm_rotation, angles, gesture.grip)

    def joints(self, state: HandState) -> tuple[Array, Array]:
        """All joints in the rig frame: positions (26, 3), rotations (26, 3, 3)."""
        return self.skeleton.joints(state.wrist_rotation, state.wrist_m, state.angles_rad)


@dataclass(frozen=True, eq=False)
class SceneObject:
    """An object: its pose at rest, and the hand that takes it or the way it goes, if any.

    solid is its shape, None if rig.toml says none.
    """

    table: ObjectTable
    solid: Solid | None
    place: ObjectPlace
    T_rig_from_rest: Array  # (4, 4)
    holder: HandName | None
    T_wrist_from_held: Array  # (4, 4)
    sweep: Sweep | None = None

    @property
    def name(self) -> str:
        return self.table.name

    @property
    def serial(self) -> str:
        return self.table.serial

    @property
    def T_object_from_tracker(self) -> Array:  # noqa: N802 - frames cancel by name
        return inverse(
            transform(rotation_from_quaternion(self.place.orientation_wxyz), self.place.offset_m)
        )

    def pose_at(self, t_s: float, hands: dict[HandName, HandState]) -> Array:
        """T_rig_from_object (4, 4) at t_s, given the hands of the same instant.

        Moves from rest to held without a jump, as the grip closes.
        """
        if self.sweep is not None:
            return self.sweep.pose(t_s)
        state = hands.get(self.holder) if self.holder else None
        if state is None or state.grip <= 0.0:
            return self.T_rig_from_rest
        T_held = state.T_rig_from_wrist @ self.T_wrist_from_held
        delta = self.T_rig_from_rest[:3, :3].T @ T_held[:3, :3]
        rotation = self.T_rig_from_rest[:3, :3] @ rotation_from_vector(
            state.grip * vector_from_rotation(delta)
        )
        position = (1.0 - state.grip) * self.T_rig_from_rest[:3, 3] + state.grip * T_held[:3, 3]
        return transform(rotation, position)


def place_hand(
    T_rig_from_view: Array, middle_m: Array, view: PalmView, travel: Travel
) -> HandPlacement:
    """A hand with its palm towards the first camera and its fingers up.

    T_rig_from_view (4, 4) is the pose of the first camera, middle_m (3,) the middle of the hand in
    that camera's frame.
    """
    tilt, yaw, roll = np.deg2rad(view)
    # Columns: the wrist's x, y (back of the hand), z (away from the fingers) in the camera's frame.
    upright = np.array(
        [[-1.0, 0.0, 0.0], [0.0, np.sin(tilt), np.cos(tilt)], [0.0, np.cos(tilt), -np.sin(tilt)]]
    )
    R_view_from_wrist = rotation_z(roll) @ rotation_y(yaw) @ upright
    axes = T_rig_from_view[:3, :3]
    rotation = axes @ R_view_from_wrist
    wrist = T_rig_from_view[:3, 3] + axes @ (middle_m - R_view_from_wrist @ MIDDLE_M)
    arm = rotation @ rotation_x(-_EXTENSION * tilt)
    return HandPlacement(rotation, wrist, arm, axes, np.array(travel.amplitude_m), travel.hz)


def lateral_offset_m(hand: HandName, hands: int) -> float:
    """How far right of the middle a hand is, as the cameras that face the palms see it."""
    if hands < 2:
        return 0.0
    return -0.5 * _HANDS_APART_M if hand == "right" else 0.5 * _HANDS_APART_M


def middle_of_cameras(cameras: list[Camera]) -> Array:
    """Middle of all cameras in the first one's frame; (3,)."""
    T_view = cameras[0].T_rig_from_camera
    middle_rig = np.mean([camera.centre_rig for camera in cameras], axis=0)
    return np.asarray(T_view[:3, :3].T @ (middle_rig - T_view[:3, 3]))
