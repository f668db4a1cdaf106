"""ROS's frames for a rig: REP 103 (x forward, y left, z up) where the cameras' are z forward. Pure.

`rhot_rig` is the frame of all that is sent. With [rig.world] it is the rig frame itself, whose z
`rhot calibrate world` makes point up; without, it stands where the first camera does, with that
camera's view along x. `rhot_camera_optical` is the first camera as REP 103 has optical frames: x
right, y down, z forward. Both rotations are proper: nothing is mirrored, a right hand stays one.
Joints keep OpenXR's axes (-z along the bone, y out of the back of the hand).
"""

from __future__ import annotations

import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.hand import HandName

RIG, CAMERA = "rhot_rig", "rhot_camera_optical"

# p_body = _BODY_FROM_OPTICAL @ p_optical: forward is z, left is -x, up is -y.
_BODY_FROM_OPTICAL = np.array(
    [
        [0.0, 0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def ros_from_rig(config: RigConfig) -> Array:
    """T_ros_from_rig (4, 4): from the frame of our messages to `rhot_rig`."""
    return _BODY_FROM_OPTICAL if config.rig.world is None else np.eye(4)


def ros_from_camera(config: RigConfig) -> Array:
    """T_ros_from_camera (4, 4): the static transform from `rhot_camera_optical` to `rhot_rig`."""
    world = config.rig.world
    T_rig_from_camera = np.eye(4) if world is None else np.array(world.T_rig_from_camera)
    return ros_from_rig(config) @ T_rig_from_camera


def joint_frame(hand: HandName, joint: str) -> str:
    """Name of a joint's frame, and of the wrist's, on which the others hang."""
    return f"{hand}_hand/{joint}"


def object_frame(name: str) -> str:
    """Name of an object's frame."""
    return f"object_{name}"
