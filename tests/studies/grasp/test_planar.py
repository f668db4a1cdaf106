"""The finger in its plane: the same kinematics as the solver's."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from services.solver.maths.kinematics import tip_position
from studies.grasp.planar import canonical, chain_of, joints_of, limits_of, read_limit


def test_the_tip_is_the_solvers():
    rng = np.random.default_rng(1)
    limits = limits_of("index", {})
    for _ in range(20):
        lengths = rng.uniform(15.0, 50.0, 3)
        angles = rng.uniform(limits[1:, 0], limits[1:, 1])
        tip = joints_of(angles[None], lengths)[0, 3]
        chain = chain_of(lengths, limits)
        assert tip_position(chain, np.append(0.0, angles)) == pytest.approx(canonical(tip))


def test_limits_are_read_and_go_before_the_tables():
    assert read_limit("pip:-10:120") == ("pip", (-10.0, 120.0))
    limits = np.rad2deg(limits_of("index", {"pip": (-10.0, 120.0)}))
    assert limits[2] == pytest.approx([-10.0, 120.0])
    assert limits[0] == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize("text", ["pip", "knee:0:90", "pip:90:0", "pip:a:b", "pip:0:900"])
def test_limits_that_are_none(text):
    with pytest.raises(CaptureError, match="expected JOINT:LOW:HIGH"):
        read_limit(text)
