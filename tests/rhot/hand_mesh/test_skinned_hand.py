"""The skin follows our joints: bones of our lengths, vertices that stay with them."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.hand import HANDS, JOINT_INDEX, default_hand, forward
from rhot.hand_mesh.glb import Glb
from rhot.hand_mesh.skinned_hand import SKIN_JOINTS, mesh_file, skinned_hand

CURLED = np.radians([[10.0, 10.0, 20.0, 30.0], *[[0.0, 60.0, 70.0, 40.0]] * 4])


@pytest.mark.parametrize("hand", HANDS)
def test_the_mesh_rests_where_its_file_says(hand):
    mesh = skinned_hand(hand)
    assert np.allclose(mesh.inverse_bind @ mesh.rest, np.eye(4), atol=1e-5)
    assert np.allclose(mesh.weights.sum(axis=1), 1.0, atol=1e-5)
    assert mesh.triangles.max() == len(mesh.vertices_m) - 1
    assert mesh.joints.max() < len(SKIN_JOINTS)


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("scale", [0.8, 1.2])
def test_the_skin_is_about_our_bones(hand, scale):
    """Vertices that follow one joint alone are within its bone's flesh, also of a curled hand."""
    model, mesh = default_hand(hand, scale), skinned_hand(hand)
    fitted = mesh.fit(*forward(model, np.eye(3), np.zeros(3), np.zeros((5, 4))))
    assert fitted.size == pytest.approx(1.1 * scale, abs=0.02 * scale)
    positions, rotations = forward(model, np.eye(3), np.zeros(3), CURLED)
    joints = np.tile(np.eye(4), (25, 1, 1))
    joints[:, :3, :3] = fitted.size * fitted.frames(rotations)
    joints[:, :3, 3] = positions[1:]
    skinning = joints @ mesh.inverse_bind
    points = np.concatenate([mesh.vertices_m, np.ones((len(mesh.vertices_m), 1))], axis=1)
    moved = np.einsum("nk,nkij,nj->ni", mesh.weights, skinning[mesh.joints], points)[:, :3]
    for name in ("index_proximal", "middle_intermediate", "little_distal", "thumb_proximal"):
        j = SKIN_JOINTS.index(name)
        own = moved[np.sum(mesh.weights * (mesh.joints == j), axis=1) > 0.95]
        a, b = positions[JOINT_INDEX[name]], positions[JOINT_INDEX[name] + 1]
        along = np.clip((own - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        apart = np.linalg.norm(own - a - along[:, None] * (b - a), axis=1)
        assert len(own) > 5
        assert apart.max() < 0.022 * scale, name


def test_an_array_that_is_added_is_read_back():
    glb = mesh_file("right")
    values = np.arange(12.0).reshape(4, 3)
    accessor = glb.add(values)
    assert np.array_equal(Glb.parse(glb.encoded()).array(accessor), values)


@pytest.mark.parametrize("content", [b"", b"glTF", b"\0" * 64, mesh_file("left").encoded()[:40]])
def test_what_is_no_glb_is_refused(content):
    with pytest.raises(CalibrationError, match="no binary glTF"):
        Glb.parse(content)
