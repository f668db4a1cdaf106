"""The written-out factorisations: Newton's step of four unknowns, the inverse of a covariance."""

from __future__ import annotations

import numpy as np
import pytest

from services.solver.maths.cholesky import factorise, newton_step4, spd_inverse


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


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 18, 26])
def test_the_factor_is_choleskys(n: int) -> None:
    """At the beginning of more memory than it needs, of which the rest stays as it is."""
    A = np.random.default_rng(n).normal(size=(n, n))
    A = A @ A.T + 0.1 * np.eye(n)
    L = np.full((n + 2, n + 2), 7.0)
    L[:n, :n] = np.tril(A)
    assert factorise(L, n, 0.0)
    found = np.tril(L[:n, :n])
    np.fill_diagonal(found, 1.0 / np.diag(found))
    np.testing.assert_allclose(found, np.linalg.cholesky(A), rtol=1e-10, atol=1e-10)
    assert (L[n:] == 7.0).all()
    assert (L[:, n:] == 7.0).all()


@pytest.mark.parametrize("row", range(5))
def test_what_is_not_definite_is_said_so(row: int) -> None:
    for pivot in (0.0, -1.0, np.nan):
        A = np.eye(5)
        A[row, row] = pivot
        assert not factorise(A.copy(), 5, 0.0)
    assert np.isfinite(spd_inverse(np.diag([1.0, 1.0, 0.0, 1.0, 1.0]))).all()
