"""Swing limits: every result inside the box, what is inside stays, each shape its own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.solver.finger.swing_limits import BOX, CIRCLE, ELLIPSE, PARABOLA, clamp_swing

LIMITS = np.array([[-0.26, 0.26], [-0.2, 1.57]])
SHAPES = (BOX, CIRCLE, ELLIPSE, PARABOLA)
angles = st.floats(-10.0, 10.0)


@given(st.sampled_from(SHAPES), angles, angles)
def test_always_inside_and_stays_there(shape: int, abduction: float, flexion: float) -> None:
    once = clamp_swing(shape, LIMITS, abduction, flexion)
    assert np.all(np.array(once) >= LIMITS[:, 0])
    assert np.all(np.array(once) <= LIMITS[:, 1])
    np.testing.assert_allclose(clamp_swing(shape, LIMITS, *once), once, atol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_middle_is_free(shape: int) -> None:
    middle = LIMITS.mean(axis=1)
    np.testing.assert_allclose(clamp_swing(shape, LIMITS, *middle), middle)


def test_a_corner_of_the_box() -> None:
    corner = LIMITS[:, 1]
    assert clamp_swing(BOX, LIMITS, *corner) == tuple(corner)
    # The ellipse cuts it off on the ray from the centre; the parabola has its apex there.
    np.testing.assert_allclose(
        clamp_swing(ELLIPSE, LIMITS, *corner),
        LIMITS.mean(axis=1) + (LIMITS[:, 1] - LIMITS[:, 0]) / np.sqrt(8.0),
    )
    np.testing.assert_allclose(
        clamp_swing(PARABOLA, LIMITS, *corner), (0.0, LIMITS[1, 1]), atol=1e-12
    )
    assert clamp_swing(PARABOLA, LIMITS, LIMITS[0, 1], LIMITS[1, 0]) == (LIMITS[0, 1], LIMITS[1, 0])
    assert np.hypot(
        *(np.array(clamp_swing(CIRCLE, LIMITS, *corner)) - LIMITS.mean(axis=1))
    ) == pytest.approx(0.26)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_joint_without_abduction(shape: int) -> None:
    fixed = np.array([[0.0, 0.0], [0.0, 1.5]])
    abduction, flexion = clamp_swing(shape, fixed, 0.3, 0.4)
    assert abduction == 0.0
    assert 0.0 <= flexion <= 1.5
