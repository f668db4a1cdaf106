"""Message building: quaternions, rounding, sources."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import quaternion_from_rotation, rotation_from_quaternion
from rhot.hand import JOINT_INDEX
from services.solver.pose_message import quaternions, rounded, rounded_inside, sources


def test_quaternions_are_those_of_transforms() -> None:
    rng = np.random.default_rng(1)
    wild = rng.normal(size=(200, 4))
    # Half turns have w = 0, where careless formulas divide by it.
    wild[:60, 0] = 0.0
    wild[:20, 1] = 0.0
    R = np.array([rotation_from_quaternion(q) for q in wild])
    ours, theirs = quaternions(R), np.array([quaternion_from_rotation(r) for r in R])
    assert np.all(ours[:, 0] >= 0.0)
    np.testing.assert_allclose(np.abs(np.sum(ours * theirs, axis=1)), 1.0, atol=1e-12)


def test_rounding_has_no_negative_zero() -> None:
    assert str(rounded(np.array([-1e-9, 0.1234567]))) == "[0.0, 0.123457]"


def test_rounding_does_not_leave_the_limits() -> None:
    limits = np.tile([-1.0 / 3.0, 1.0 / 3.0], (5, 4, 1))
    inside = rounded_inside(np.full((5, 4), 1.0 / 3.0), limits)
    assert np.all(inside <= limits[..., 1])
    assert rounded_inside(np.full((5, 4), 0.1234567), limits)[0, 0] == pytest.approx(0.123457)


def test_sources() -> None:
    found = sources(
        {"wrist", "index_tip", "middle_proximal"}, True, [False, True, True, False, False]
    )
    at = {name: found[JOINT_INDEX[name]] for name in JOINT_INDEX}
    assert at["wrist"] == at["index_tip"] == at["middle_proximal"] == "measured"
    assert (
        at["palm"]
        == at["index_distal"]
        == at["middle_tip"]
        == at["ring_proximal"]
        == at["thumb_metacarpal"]
        == "solved"
    )
    assert at["ring_distal"] == at["thumb_tip"] == "predicted"
    assert set(sources(set(), False, [True] * 5)) == {"predicted"}
