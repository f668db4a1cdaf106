"""Normal equations: against numpy's least squares, and what is singular."""

from __future__ import annotations

import numpy as np

from services.fusion.geometry.normal_equations import (
    add_equation,
    invert_symmetric,
    multiply,
    solve_symmetric,
)


def test_the_solution_is_that_of_least_squares():
    random = np.random.default_rng(0)
    rows, values = random.normal(size=(7, 3)), random.normal(size=7)
    A, A_inverse, b, x = np.zeros((3, 3)), np.empty((3, 3)), np.zeros(3), np.empty(3)
    for row, value in zip(rows, values, strict=True):
        add_equation(row, value, A, b)
    assert invert_symmetric(A, A_inverse)
    np.testing.assert_allclose(A_inverse, np.linalg.inv(rows.T @ rows), rtol=1e-10)
    np.testing.assert_array_equal(A_inverse, A_inverse.T)
    multiply(A_inverse, b, x)
    np.testing.assert_allclose(x, np.linalg.lstsq(rows, values, rcond=None)[0], rtol=1e-10)
    again = np.empty(3)
    assert solve_symmetric(A, b, again)
    np.testing.assert_array_equal(again, x)


def test_equations_of_one_plane_or_not_finite_are_singular():
    A, out = np.zeros((3, 3)), np.empty((3, 3))
    for row in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]):
        add_equation(np.array(row), 0.0, A, np.zeros(3))
    assert not invert_symmetric(A, out)
    assert not solve_symmetric(A, np.zeros(3), np.empty(3))
    assert not invert_symmetric(np.full((3, 3), np.nan), out)
