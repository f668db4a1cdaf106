"""The bounded quadratic programme: optimality conditions, against scipy, at its edges."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from services.solver.maths.box_qp import box_qp, workspace


def _problem(
    rng: np.random.Generator, n: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    A = rng.normal(size=(n + 3, n)) * 10.0 ** rng.uniform(-2.0, 0.5, n)
    b = rng.normal(size=n + 3)
    low, high = -(10.0 ** rng.uniform(-3.0, 1.0, n)), 10.0 ** rng.uniform(-3.0, 1.0, n)
    # Some unknowns stand at a bound, as angles do at their limits, and some cannot move at all.
    low[rng.random(n) < 0.3] = 0.0
    high[rng.random(n) < 0.1] = 0.0
    return A, b, low, high, A.T @ A + 1e-9 * np.eye(n)


@pytest.mark.parametrize("n", [1, 4, 26])
def test_the_optimum_of_random_problems(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(200):
        A, b, low, high, H = _problem(rng, n)
        g, x = -A.T @ b, np.empty(n)
        assert box_qp(H, g, low, high, x, workspace(n))
        assert np.all(x >= low)
        assert np.all(x <= high)
        slope = H @ x + g
        scale = 1e-7 * (1.0 + np.abs(g).max())
        assert np.all(np.abs(slope[(x > low) & (x < high)]) <= scale)
        assert np.all(slope[(x == low) & (low < high)] >= -scale)
        assert np.all(slope[(x == high) & (low < high)] <= scale)


def test_the_same_as_scipy() -> None:
    rng = np.random.default_rng(9)
    for _ in range(30):
        A, b, low, high, H = _problem(rng, 6)
        high = np.maximum(high, low + 1e-3)
        x = np.empty(6)
        box_qp(H, -A.T @ b, low, high, x, workspace(6))
        theirs = lsq_linear(A, b, (low, high), tol=1e-14)
        assert (
            0.5 * x @ H @ x - x @ A.T @ b
            <= 0.5 * theirs.x @ H @ theirs.x - theirs.x @ A.T @ b + 1e-9
        )


def test_infinite_bounds_are_newtons_step() -> None:
    H, g, x = np.diag([2.0, 4.0]), np.array([-2.0, 4.0]), np.empty(2)
    assert box_qp(H, g, np.full(2, -np.inf), np.full(2, np.inf), x, workspace(2))
    np.testing.assert_allclose(x, [1.0, -1.0])


@pytest.mark.parametrize("broken", [np.zeros((2, 2)), -np.eye(2), np.full((2, 2), np.nan)])
def test_what_is_not_definite_is_refused_inside_the_bounds(broken: np.ndarray) -> None:
    x = np.empty(2)
    one = np.ones(2)
    assert not box_qp(broken, one, -one, one, x, workspace(2))
    assert np.all(np.abs(x) <= 1.0)
