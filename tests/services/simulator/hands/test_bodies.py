"""Bodies: a hand's skin is where its model says."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import JOINT_INDEX, TIPS, default_hand, forward
from services.simulator.hands.bodies import ARM, HAND_FRAMES, ShapeBuilder, add_hand


@pytest.mark.parametrize("hand", ["left", "right"])
def test_fingers_end_at_their_tips_and_the_wrist_is_as_thick_as_said(hand):
    model = default_hand(hand)
    shapes = ShapeBuilder()
    add_hand(shapes, model, 0, 0, {"index_tip": 3, "wrist": 4})
    table = shapes.arrays()
    positions, rotations = forward(model, np.eye(3), np.zeros(3), model.limits_rad.mean(axis=2))
    ends = {}
    for c, (_, b) in enumerate(table.frame):
        if b < ARM:
            ends[int(b)] = positions[b] + rotations[b] @ table.offset[c, 1], table.radius[c, 1], c
    for name in TIPS:
        joint = JOINT_INDEX[name]
        middle, radius, c = ends[joint]
        # The skin's end, along the bone.
        np.testing.assert_allclose(
            middle - radius * rotations[joint][:, 2], positions[joint], atol=1e-9
        )
        assert table.kind[c, 1] == (3 if name == "index_tip" else -1)
    assert table.dab_surface.tolist() == [4]
    wrist = JOINT_INDEX["wrist"]
    reach = [
        r[0]
        for f, o, r in zip(table.frame, table.offset, table.radius, strict=True)
        if f[0] == wrist and not o[0].any()
    ]
    assert max(reach) == model.wrist_radius_m
    assert np.linalg.norm(table.dab_offset[0]) == pytest.approx(model.wrist_radius_m)
    assert table.frame.max() < HAND_FRAMES


def test_hands_mirror():
    tables = []
    for hand in ("left", "right"):
        shapes = ShapeBuilder()
        add_hand(shapes, default_hand(hand), 0, 0, {})
        tables.append(shapes.arrays())
    left, right = tables
    np.testing.assert_array_equal(left.radius, right.radius)
    np.testing.assert_allclose(left.offset * (-1, 1, 1), right.offset, atol=1e-12)
