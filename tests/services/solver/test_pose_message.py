"""Building the message: rounding, and where joints come from."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import JOINT_INDEX
from services.solver.pose_message import joint_sources, rounded, rounded_within_limits


def test_rounding_has_no_negative_zero() -> None:
    assert str(rounded(np.array([-1e-9, 0.1234567]))) == "[0.0, 0.123457]"


def test_rounding_does_not_leave_the_limits() -> None:
    limits = np.tile(np.array([-1.0 / 3.0, 1.0 / 3.0]), (5, 4, 1))
    inside = rounded_within_limits(np.full((5, 4), 1.0 / 3.0), limits)
    assert np.all(inside <= limits[..., 1])
    assert rounded_within_limits(np.full((5, 4), 0.1234567), limits)[0, 0] == pytest.approx(
        0.123457
    )


def test_sources() -> None:
    found = joint_sources(
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
    assert set(joint_sources(set(), False, [True] * 5)) == {"predicted"}
