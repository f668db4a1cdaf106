"""Optimal assignment of dots to patches: each patch to at most one dot, no dot to a bad patch.

Shortest augmenting paths (Jonker & Volgenant, A Shortest Augmenting Path Algorithm for Dense and
Sparse Linear Assignment Problems, Computing 38, 1987). Pure; numpy only, since pi_tracker starts
without scipy.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


def assign(gains: Array) -> Indices:
    """The column of each row with the largest sum of gains, -1 for none; (n, m) -> (n,).

    A gain that is not above 0 is never taken; -inf is allowed.
    """
    rows, columns = gains.shape
    result = np.full(rows, -1, np.int64)
    if not rows or not columns:
        return result
    best = gains.argmax(axis=1)
    wanted = gains[np.arange(rows), best] > 0.0
    if len(set(best[wanted].tolist())) == int(wanted.sum()):
        # As a rule no two dots want the same patch.
        result[wanted] = best[wanted]
        return result
    # To stay without is a column of its own for each row.
    cost = np.zeros((rows, columns + rows))
    cost[:, :columns] = -np.maximum(gains, 0.0)
    found = _shortest_paths(cost)
    taken = found < columns
    taken[taken] = gains[taken, found[taken]] > 0.0
    result[taken] = found[taken]
    return result


def _shortest_paths(cost: Array) -> Indices:
    """The column of each row with the least sum of costs; (n, m) with n <= m -> (n,)."""
    rows, columns = cost.shape
    row_price, column_price = np.zeros(rows), np.zeros(columns)
    row_of = np.full(columns, -1, np.int64)
    for start in range(rows):
        distance = np.full(columns, np.inf)
        before = np.full(columns, -1, np.int64)
        done = np.zeros(columns, bool)
        row, at, column = start, 0.0, -1
        while True:
            through = at + cost[row] - row_price[row] - column_price
            shorter = ~done & (through < distance)
            distance[shorter], before[shorter] = through[shorter], row
            column = int(np.where(done, np.inf, distance).argmin())
            at, done[column] = float(distance[column]), True
            if row_of[column] < 0:
                break
            row = int(row_of[column])
        _update_prices(row_price, column_price, row_of, distance, done, at, start)
        while True:
            row = int(before[column])
            earlier = np.flatnonzero(row_of == row)
            row_of[column] = row
            if row == start:
                break
            column = int(earlier[earlier != column][0])
    result = np.empty(rows, np.int64)
    used = row_of >= 0
    result[row_of[used]] = np.flatnonzero(used)
    return result


def _update_prices(
    row_price: Array,
    column_price: Array,
    row_of: Indices,
    distance: Array,
    done: npt.NDArray[np.bool_],
    at: float,
    start: int,
) -> None:
    """The dual prices after a path of length `at` from a row."""
    scanned = done & (row_of >= 0)
    row_price[start] += at
    row_price[row_of[scanned]] += at - distance[scanned]
    column_price[done] -= at - distance[done]
