"""Estimated lengths of a hand, and how much of each the recording determined. Pure.

A length is determined by as much of the tables' spread as the recording took away; what remains is
the table's.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import msgspec
import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, TIPS, HandModel
from services.calibrator.hand.hand_parameters import (
    BASE_ROWS,
    METACARPAL_ROWS,
    OFFSET_ROWS,
    SIZE,
    HandParameters,
    triple,
)

# Share of the spread that the tables leave at a known size of the hand: at 0.6 the recording weighs
# twice what the table does.
_DETERMINED, _PARTLY = 0.6, 0.85
_FINGER_BONES = ("proximal", "middle", "distal")
_BONES = (("metacarpal", "proximal", "distal"), *(_FINGER_BONES,) * 4)

Source = Literal["data", "partly", "table", "by hand"]


class Length(msgspec.Struct, frozen=True, kw_only=True):
    """One length, in metres."""

    name: str
    table_m: float
    estimate_m: float
    sigma_m: float
    source: Source


class _Estimate(NamedTuple):
    """A length before and after, and its derivative by the measures."""

    name: str
    table_m: float
    estimate_m: float
    by_measure: Array  # (measures,)
    by_hand: bool = False


def estimated_lengths(
    parameters: HandParameters, x: Array, covariance: Array, table: HandModel
) -> list[Length]:
    """Metacarpal, bones and reach of every digit of the hand x (p,), compared with the hand table.

    covariance (p, p) of x.
    """
    model = parameters.model(x)
    G = parameters.geometry(x).G
    # The size is known from the open hand at once; what is asked here is what the exercises add.
    G_of_known_size = np.delete(G, SIZE, axis=1)
    posterior = G @ covariance @ G.T
    prior = G_of_known_size @ G_of_known_size.T
    return [
        _length(estimate, prior, posterior)
        for digit in range(len(DIGITS))
        for estimate in _estimates(parameters, digit, table, model)
    ]


def _length(estimate: _Estimate, prior: Array, posterior: Array) -> Length:
    row = estimate.by_measure
    sigma, prior_sigma = (
        float(np.sqrt(np.maximum(row @ C @ row, 0.0))) for C in (posterior, prior)
    )
    remaining = sigma / prior_sigma if prior_sigma > 0.0 else 0.0
    source: Source = "table"
    if estimate.by_hand:
        source = "by hand"
    elif remaining < _DETERMINED:
        source = "data"
    elif remaining < _PARTLY:
        source = "partly"
    return Length(
        name=estimate.name,
        table_m=round(estimate.table_m, 6),
        estimate_m=round(estimate.estimate_m, 6),
        sigma_m=round(sigma, 6),
        source=source,
    )


def _estimates(
    parameters: HandParameters, d: int, table: HandModel, model: HandModel
) -> Iterator[_Estimate]:
    """One digit's lengths."""
    old, new = table.digits[d], model.digits[d]
    if d > 0:
        before = np.array(old.base_m) - np.array(old.metacarpal_m)
        along = np.array(new.base_m) - np.array(new.metacarpal_m)
        direction = along / np.linalg.norm(along)
        row = np.zeros(parameters.measures)
        row[triple(BASE_ROWS, d)] = direction
        row[triple(METACARPAL_ROWS, d)] = -direction
        lengths_m = [float(np.linalg.norm(v)) for v in (before, along)]
        yield _Estimate(f"{DIGITS[d]} metacarpal", lengths_m[0], lengths_m[1], row)
    # From the digit's root to the middle of its paint: what tips show.
    reach = np.zeros(parameters.measures)
    for bone, name in enumerate(_BONES[d]):
        row = np.zeros(parameters.measures)
        row[3 * d + bone] = reach[3 * d + bone] = 1.0
        by_hand = (d, bone) in parameters.known
        before_m, after_m = old.lengths_m[bone], new.lengths_m[bone]
        yield _Estimate(f"{DIGITS[d]} {name}", before_m, after_m, row, by_hand)
    tip = parameters.names.index(TIPS[d])
    reach[OFFSET_ROWS + 3 * tip + 2] = -1.0
    before_m, after_m = (
        sum(m.digits[d].lengths_m) - m.paint[TIPS[d]].offset_m[2] for m in (table, model)
    )
    yield _Estimate(f"{DIGITS[d]}, root to paint", before_m, after_m, reach)
