"""First-order propagation of uncertainty through any function, by central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array

# Of inputs of size 1: differences then lose a third of the digits at most.
_STEP = 1e-5
# Of each input's sigma: small beside what the function is linear over, large beside rounding.
_SIGMA_SHARE = 0.01


def jacobian(
    function: Callable[[Array], Array], at: npt.ArrayLike, steps: Array | None = None
) -> Array:
    """Derivatives (..., k) of a function's results (...) by its k inputs, at (k,). steps (k,): how
    far each is moved to either side, 0 for one that has no derivative; default: for inputs about 1.
    """
    x = np.asarray(at, dtype=np.float64)
    steps = np.full(len(x), _STEP) if steps is None else steps
    columns = []
    for number, size in enumerate(steps):
        step = np.zeros_like(x)
        step[number] = size
        rise = function(x + step) - function(x - step)
        columns.append(rise / (2.0 * size) if size > 0.0 else np.zeros_like(rise))
    return np.stack(columns, axis=-1)


def sigma_steps(covariance: Array) -> Array:
    """Steps (k,) for `jacobian` of inputs whose covariance (k, k) is known."""
    return _SIGMA_SHARE * np.sqrt(np.maximum(np.diag(covariance), 0.0))


def propagated(
    function: Callable[[Array], Array], at: npt.ArrayLike, covariance: Array
) -> tuple[Array, Array]:
    """A function's results (m,) and their covariance (m, m), to first order."""
    x = np.asarray(at, dtype=np.float64)
    J = jacobian(function, x, sigma_steps(covariance))  # (m, k)
    return function(x), J @ covariance @ J.T
