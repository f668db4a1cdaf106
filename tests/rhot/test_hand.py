import itertools

import msgspec
import numpy as np
import pytest

from rhot import hand as h
from rhot.geometry.transforms import rotation_from_vector


@pytest.fixture(params=["left", "right"])
def model(request):
    return h.default_hand(request.param)


def angles_within(model, seed):
    limits = model.limits_rad
    return np.random.default_rng(seed).uniform(limits[..., 0], limits[..., 1])


def test_joints_are_the_26_of_openxr_in_order():
    assert len(h.JOINTS) == 26
    assert h.JOINTS[:3] == ("palm", "wrist", "thumb_metacarpal")
    assert h.JOINTS[6] == "index_metacarpal"
    assert h.JOINTS[25] == "little_tip"
    assert set(h.LANDMARKS) == set(h.JOINTS)


def test_bones_keep_their_lengths(model):
    positions, _ = h.forward(model, np.eye(3), np.zeros(3), angles_within(model, 1))
    chains = positions[h.CHAIN_JOINTS]  # (5, 4, 3)
    assert np.allclose(np.linalg.norm(np.diff(chains, axis=1), axis=2), model.lengths_m, atol=1e-12)


def test_each_bone_points_along_minus_z_of_its_joint(model):
    positions, rotations = h.forward(model, np.eye(3), np.zeros(3), angles_within(model, 2))
    for chain in h.CHAIN_JOINTS:
        for joint, following in itertools.pairwise(chain):
            bone = positions[following] - positions[joint]
            assert np.allclose(bone / np.linalg.norm(bone), -rotations[joint][:, 2], atol=1e-12)


def test_flexion_moves_tips_to_the_palm_and_abduction_to_the_thumb(model):
    straight, _ = h.forward(model, np.eye(3), np.zeros(3), np.zeros((5, 4)))
    bent, abducted = np.zeros((5, 4)), np.zeros((5, 4))
    bent[1:, 1], abducted[1:, 0] = 0.3, 0.2
    tips = h.CHAIN_JOINTS[1:, 3]
    thumb_side = -model.side  # the thumb of a right hand, palm down, is on the left
    assert (h.forward(model, np.eye(3), np.zeros(3), bent)[0][tips, 1] < straight[tips, 1]).all()
    moved = h.forward(model, np.eye(3), np.zeros(3), abducted)[0][tips, 0] - straight[tips, 0]
    assert (moved * thumb_side > 0.0).all()


def test_left_is_the_mirror_of_right():
    left, right = h.default_hand("left"), h.default_hand("right")
    angles = angles_within(right, 5)
    a, _ = h.forward(left, np.eye(3), np.zeros(3), angles)
    b, _ = h.forward(right, np.eye(3), np.zeros(3), angles)
    assert np.allclose(a, b * [-1.0, 1.0, 1.0], atol=1e-12)


def test_the_whole_hand_moves_rigidly(model):
    rotation, position = rotation_from_vector([0.4, -1.2, 2.0]), np.array([0.1, -0.2, 0.5])
    angles = angles_within(model, 7)
    at_origin, frames = h.forward(model, np.eye(3), np.zeros(3), angles)
    moved, moved_frames = h.forward(model, rotation, position, angles)
    assert np.allclose(moved, at_origin @ rotation.T + position, atol=1e-12)
    assert np.allclose(moved_frames, rotation @ frames, atol=1e-12)


def test_equals_the_denavit_hartenberg_rows_of_the_finger_study():
    """The finger study's Appendix A1, four standard D-H rows (theta, d, a, alpha).

    (theta1, 0, 0, 90 deg), (theta2, 0, l1, 0), (theta3, 0, l2, 0), (theta4, 0, l3, 0).
    """

    def row(theta, a, alpha):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        return np.array(
            [
                [c, -s * ca, s * sa, a * c],
                [s, c * ca, -c * sa, a * s],
                [0, sa, ca, 0],
                [0, 0, 0, 1.0],
            ]
        )

    model = h.default_hand("right")
    index = model.digits[1]
    angles = np.array([0.1, 0.7, 0.9, 0.6])
    T = (
        row(angles[0], 0, np.pi / 2)
        @ row(angles[1], index.lengths_m[0], 0)
        @ row(angles[2], index.lengths_m[1], 0)
    )
    tip = (T @ row(angles[3], index.lengths_m[2], 0))[:3, 3]
    # The study's x runs along the straight finger, z to the side the finger bends to, y to the
    # thumb side.
    axes = np.array(
        [[0, -1, 0], [0, 0, -1], [-1, 0, 0]], dtype=float
    )  # finger frame (x right, y back, z) from the study's
    flat = msgspec.structs.replace(index, base_m=(0.0, 0.0, 0.0), base_wxyz=(1.0, 0.0, 0.0, 0.0))
    flat_model = msgspec.structs.replace(model, digits=(model.digits[0], flat, *model.digits[2:]))
    all_angles = np.zeros((5, 4))
    all_angles[1] = angles
    positions, _ = h.forward(flat_model, np.eye(3), np.zeros(3), all_angles)
    assert np.allclose(positions[h.JOINT_INDEX["index_tip"]], axes @ tip, atol=1e-12)


def test_a_painted_tip_stands_inside_the_finger(model):
    positions, rotations = h.forward(model, np.eye(3), np.zeros(3), angles_within(model, 3))
    point = h.landmark_point(model, "index_tip", positions, rotations)
    tip, dip = (positions[h.JOINT_INDEX[name]] for name in ("index_tip", "index_distal"))
    assert np.isclose(
        np.linalg.norm(point - tip) + np.linalg.norm(point - dip), np.linalg.norm(tip - dip)
    )


def test_survives_json(model):
    assert msgspec.json.decode(msgspec.json.encode(model), type=h.HandModel) == model
