"""The assignment solver against trying everything."""

from __future__ import annotations

from itertools import product

import numpy as np

from services.pi_tracker.dots.assignment import assign


def _best_sum(gains: np.ndarray) -> float:
    rows, columns = gains.shape
    sums = [0.0]
    for choice in product(range(-1, columns), repeat=rows):
        used = [column for column in choice if column >= 0]
        if len(used) == len(set(used)):
            sums.append(sum(gains[row, column] for row, column in enumerate(choice) if column >= 0))
    return max(sums)


def test_no_other_assignment_gains_more() -> None:
    random = np.random.default_rng(3)
    for _ in range(150):
        rows, columns = random.integers(1, 5, 2)
        gains = random.normal(0.4, 1.0, (rows, columns))
        gains[random.random((rows, columns)) < 0.2] = -np.inf
        found = assign(gains)
        taken = np.flatnonzero(found >= 0)
        assert len(set(found[taken].tolist())) == len(taken)
        assert (gains[taken, found[taken]] > 0.0).all()
        assert np.isclose(gains[taken, found[taken]].sum(), _best_sum(gains))


def test_nothing_to_assign() -> None:
    assert assign(np.empty((2, 0))).tolist() == [-1, -1]
    assert assign(np.empty((0, 3))).tolist() == []
    assert assign(np.full((2, 2), -np.inf)).tolist() == [-1, -1]
