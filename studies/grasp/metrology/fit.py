"""Least squares by Levenberg and Marquardt, with Huber's weights for what may be an outlier."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from studies.grasp.metrology.segments import inverted
from studies.grasp.metrology.uncertainty import jacobian

S = TypeVar("S")
# Residuals beyond so many sigmas count by their size, not by its square.
_HUBER = 2.0
_ROUNDS, _SMALLEST_STEP, _LARGEST_DAMPING = 60, 1e-7, 1e9


class Problem(NamedTuple):
    """Residuals in sigmas, of which the last `trusted` are no outliers (priors); `size` parameters,
    each about 1.
    """

    size: int
    trusted: int


def fitted(
    problem: Problem,
    start: S,
    residuals: Callable[[S], Array],
    moved: Callable[[S, Array], S],
) -> tuple[S, Array]:
    """The state that fits best, and the information (size, size) of a step from it. moved takes a
    state by a step (size,). CalibrationError where a direction is not determined.
    """
    state, damping = start, 1e-3
    for _ in range(_ROUNDS):
        here = state

        def after(step: Array, here: S = here) -> Array:
            return residuals(moved(here, step))

        off, J = after(np.zeros(problem.size)), jacobian(after, np.zeros(problem.size))
        weight = np.minimum(1.0, _HUBER / np.maximum(np.abs(off), 1e-12))
        weight[len(off) - problem.trusted :] = 1.0
        information = (J * weight[:, None]).T @ J
        if np.linalg.eigvalsh(information)[0] < 1e-9:
            raise CalibrationError(
                "what was given does not determine the plane or lens: edges lie on one line, or"
                " points on each other; give some that are apart"
            )
        damped = information + damping * np.diag(np.diag(information))
        step = -inverted(damped) @ (J.T @ (weight * off))
        if _cost(after(step), problem) <= _cost(off, problem):
            state, damping = moved(state, step), max(0.2 * damping, 1e-9)
            if np.abs(step).max() < _SMALLEST_STEP:
                break
        else:
            damping *= 10.0
            if damping > _LARGEST_DAMPING:
                break
    return state, information


def _cost(off: Array, problem: Problem) -> float:
    """Huber's, infinite where a residual is no number."""
    if not np.isfinite(off).all():
        return float("inf")
    size = np.abs(off)
    square = 0.5 * size**2
    robust = np.where(size < _HUBER, square, _HUBER * (size - 0.5 * _HUBER))
    first = len(off) - problem.trusted
    return float(robust[:first].sum() + square[first:].sum())
