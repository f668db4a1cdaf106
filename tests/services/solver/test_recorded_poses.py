"""Real hands: three recorded OpenXR poses, as a test of frames and of one finger's solution."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import CHAIN_JOINTS, DIGITS, JOINTS, Digit, chain_forward, default_hand
from services.solver.finger import dls
from services.solver.finger.dls_equations import POSE, POSITION, tip_goal
from services.solver.maths.chains import Chain, canonical_from_wrist
from services.solver.maths.kinematics import tip_position

FINGERS = ("index", "middle", "ring", "little")


def _openxr_poses(folder: Path) -> dict[str, dict[str, Array]]:
    """Joint name -> 4x4 in the wrist's frame, for each recorded pose."""
    bones = {
        "metacarpal": "metacarpal",
        "tip": "tip",
        **{b: f"phalanx-{b}" for b in ("proximal", "intermediate", "distal")},
    }
    poses = {}
    for path in sorted((folder / "hand_motion/openxr_poses").glob("*.json")):
        read = json.loads(path.read_text())["jointTransforms"]
        found = {"wrist": read["wrist"]}
        for name in JOINTS[2:]:
            digit, bone = name.split("_")
            digit = {"thumb": "thumb", "little": "pinky-finger"}.get(digit, f"{digit}-finger")
            found[name] = read[f"{digit}-{bones[bone]}"]
        matrices = {
            name: np.array(joint["offsetMatrix"]).reshape(4, 4).T for name, joint in found.items()
        }
        back = np.linalg.inv(matrices["wrist"])
        poses[path.stem] = {name: back @ T for name, T in matrices.items()}
    return poses


def test_recorded_poses_are_of_a_left_hand_in_our_frames(rhot_data: Path) -> None:
    """What rhot/hand.py says of frames: thumb on +x, -z along every bone, and so on.

    +y out of the back, flexion about -x.
    """
    table = default_hand("left")
    for pose in _openxr_poses(rhot_data).values():
        assert pose["thumb_tip"][0, 3] > pose["little_tip"][0, 3]
        assert pose["index_proximal"][0, 3] > pose["little_proximal"][0, 3]
        for row, digit in enumerate(table.digits):
            names = [JOINTS[joint] for joint in CHAIN_JOINTS[row]]
            for near, far in itertools.pairwise(names[:3]):
                bone = pose[far][:3, 3] - pose[near][:3, 3]
                np.testing.assert_allclose(
                    -pose[near][:3, 2], bone / np.linalg.norm(bone), atol=1e-3
                )
            # The table's knuckles are where a real hand has them, to the width of a finger.
            assert np.linalg.norm(pose[names[0]][:3, 3] - digit.base_m) < 0.02


def _openxr_digit(
    pose: dict[str, Array], row: int, digit: Digit
) -> tuple[Chain, Array, Array, Array]:
    """Chain with the pose's own bone lengths, its base, and the tip's pose.

    The tip and the last bone's axes are in the canonical frame.
    """
    joints = [pose[JOINTS[joint]] for joint in CHAIN_JOINTS[row]]
    base = rotation_from_quaternion(digit.base_wxyz)
    lengths = np.array([np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in itertools.pairwise(joints)])
    limits = np.array(digit.limits_rad) + np.deg2rad(
        [[-25.0, 25.0], [-25.0, 15.0], [-15.0, 10.0], [-35.0, 10.0]]
    )
    chain = Chain(lengths, np.array([0.0, 0.0, -lengths[2]]), limits, np.array([2 / 3, 1.0]))
    target = canonical_from_wrist(joints[0][:3, 3], base, -1.0, joints[3][:3, 3])
    mirror = np.diag([-1.0, 1.0, 1.0])
    return chain, base, target, mirror @ base.T @ joints[2][:3, :3] @ mirror


@pytest.mark.parametrize("name", FINGERS)
def test_recorded_poses_are_reproduced(rhot_data: Path, name: str) -> None:
    """From knuckle and tip pose: tip within 0.1 mm, joints within 5 mm.

    Real fingers twist by some degrees, ours do not.
    """
    row = DIGITS.index(name)
    for stem, pose in _openxr_poses(rhot_data).items():
        digit = default_hand("left").digits[row]
        chain, base, target, axes = _openxr_digit(pose, row, digit)
        q = np.zeros(4)
        dls.solve(chain, tip_goal(POSE, target, axes), q, 60, 1e-4)
        dls.solve(chain, tip_goal(POSITION, target), q, 60, 1e-4)
        tip_off = np.linalg.norm(tip_position(chain, q) - target)
        assert tip_off < 1e-4
        recorded = np.array([pose[JOINTS[joint]][:3, 3] for joint in CHAIN_JOINTS[row]])
        positions, _ = chain_forward(base, recorded[0], chain.lengths, (-q[0], *q[1:]))
        joint_off = np.linalg.norm(positions - recorded, axis=1)
        assert max(joint_off) < 5e-3
        print(
            f"{stem:8s} {name:7s} tip {1e3 * tip_off:.2f} mm, "
            f"joints within {1e3 * max(joint_off):.1f} mm"
        )
