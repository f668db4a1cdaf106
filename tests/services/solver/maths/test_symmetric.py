import numpy as np

from services.solver.maths.symmetric import eigen


def test_eigenvalues_and_axes_are_those_of_lapack() -> None:
    rng = np.random.default_rng(3)
    for n in range(2000):
        size = 10.0 ** rng.uniform(-12.0, 1.0)
        wanted = size * rng.normal(size=(3, 3))
        wanted += wanted.T
        if n % 3 == 0:  # one direction hardly known, as along a camera's ray
            wanted = wanted @ wanted + size * np.diag([1e3, 0.0, 0.0])
        A, axes = wanted.copy(), np.empty((3, 3))
        eigen(A, axes)
        rounding = 1e-14 * np.abs(wanted).max()
        np.testing.assert_allclose(np.sort(np.diag(A)), np.linalg.eigvalsh(wanted), atol=rounding)
        np.testing.assert_allclose(axes @ np.diag(np.diag(A)) @ axes.T, wanted, atol=rounding)
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)


def test_what_is_diagonal_stays() -> None:
    for values in ([0.0, 0.0, 0.0], [3.0, 1.0, 2.0]):
        A, axes = np.diag(values), np.empty((3, 3))
        eigen(A, axes)
        assert np.array_equal(A, np.diag(values))
        assert np.array_equal(axes, np.eye(3))
