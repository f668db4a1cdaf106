"""The written-out factorisations: Newton's step of four unknowns, the inverse of a covariance."""

from __future__ import annotations

import numpy as np
import pytest

from services.solver.maths.cholesky import newton_step4, spd_inverse


def test_the_written_out_step_is_newtons() -> None:
    rng, x = np.random.default_rng(4), np.empty(4)
    for _ in range(100):
        A, g = rng.normal(size=(5, 4)), rng.normal(size=4)
        H = A.T @ A + 1e-6 * np.eye(4)
        assert newton_step4(H, g, x)
        np.testing.assert_allclose(H @ x, -g, atol=1e-7 * np.linalg.norm(x) * np.linalg.norm(H))
    for broken in (np.zeros((4, 4)), -np.eye(4), np.full((4, 4), np.nan)):
        assert not newton_step4(broken, np.ones(4), x)


@pytest.mark.parametrize("n", [1, 5, 26])
def test_inverse(n: int) -> None:
    A = np.random.default_rng(1).normal(size=(n, n))
    A = A @ A.T + 0.1 * np.eye(n)
    np.testing.assert_allclose(spd_inverse(A), np.linalg.inv(A), rtol=1e-9, atol=1e-9)
