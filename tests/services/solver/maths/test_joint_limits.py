"""Hard limits of joint angles."""

from __future__ import annotations

import numpy as np

from services.solver.maths.joint_limits import clamp_to_limits


def test_clamp_puts_everything_inside() -> None:
    limits = np.array([[-1.0, 1.0], [0.0, 0.0], [0.0, 2.0], [0.0, 1.0]])
    q = np.array([-5.0, 3.0, np.nan, np.inf])
    clamp_to_limits(q, limits)
    np.testing.assert_array_equal(q, [-1.0, 0.0, 1.0, 0.5])
