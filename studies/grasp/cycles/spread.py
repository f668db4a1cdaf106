"""Mean and spread of curves over cycles and over people. Pure.

Cycles of one person are averaged first, then people: somebody with ten cycles counts as much as
somebody with two.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array


class Spread(NamedTuple):
    """Of n curves of one shape, at each of their points; NaN where none was measured."""

    mean: Array
    sd: Array  # with n - 1; NaN for a single curve
    known: Array  # curves measured there


def spread(curves: Sequence[Array]) -> Spread:
    """Mean and standard deviation of equally shaped curves, unmeasured points left out."""
    stack = np.array(curves, dtype=np.float64)
    finite = np.isfinite(stack)
    count = finite.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(finite, stack, 0.0).sum(axis=0) / count
        squares = (np.where(finite, stack - mean, 0.0) ** 2).sum(axis=0)
        sd = np.sqrt(squares / (count - 1))
    return Spread(np.where(count > 0, mean, np.nan), np.where(count > 1, sd, np.nan), count)


class PeopleSpread(NamedTuple):
    """Of several people with several cycles each."""

    mean: Array  # of the people's means
    between_sd: Array  # of the people's means
    within_sd: Array  # of one person's cycles, pooled over people


def spread_over_people(people: Sequence[Sequence[Array]]) -> PeopleSpread:
    """people[k] are the curves of one person."""
    own = [spread(curves) for curves in people]
    total = spread([one.mean for one in own])
    freedom = sum(np.maximum(one.known - 1, 0) for one in own)
    squares = sum(np.nan_to_num(one.sd, nan=0.0) ** 2 * np.maximum(one.known - 1, 0) for one in own)
    with np.errstate(invalid="ignore", divide="ignore"):
        within = np.sqrt(squares / freedom)
    return PeopleSpread(total.mean, total.sd, np.where(np.asarray(freedom) > 0, within, np.nan))
