"""What one camera sees alone, by the shape that its hand had when two cameras saw it last.

One camera tells a landmark's direction and not its distance. But the hand that it belongs to has a
size in that camera's picture, and other landmarks may still be seen by two. So the shape of the
last instant at which two cameras saw the landmark is moved as one piece onto what is known now, and
the landmark is told between its ray and its place in that shape, as unsure as its hand deforms: at
first as fast as lately (kept_shape.py learns it), and never more than fingers can. Compiled;
nothing here raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.kalman.shape.kept_shape import LEAST, ShapeMemory, hold_shape

# How far a landmark's place in its hand wanders, 1 sigma: TIMES as fast as it lately did, at least
# at this rate, and never more than so far. Tuning motions of benchmarks/one_camera.py, three tips
# hidden for .5 s, geometric mean of RMS: with .06 m/s, 1.5 and .03 m 10.6 mm, with these 8.7.
LEAST_RATE_M_S, TIMES, FARTHEST_M = 0.03, 0.6, 0.015


class LocatedShapes(NamedTuple):
    """Of each of L landmarks, all places of the last instant at which two cameras saw it."""

    time_s: Array  # (L,)
    places: Array  # (L, L, 3) NaN where not known
    covs: Array  # (L, L, 3, 3)


def no_shapes(landmarks: int) -> LocatedShapes:
    """Nothing seen yet."""
    shape = (landmarks, landmarks, 3)
    return LocatedShapes(np.full(landmarks, -np.inf), np.full(shape, np.nan), np.zeros((*shape, 3)))


@njit(cache=True, error_model="numpy")
def note_shapes(
    shapes: LocatedShapes, located: Bools, places: Array, covs: Array, time_s: float
) -> None:
    """Remember places (L, 3), (L, 3, 3) for each landmark that two cameras see (L,)."""
    for row in np.flatnonzero(located):
        shapes.time_s[row] = time_s
        shapes.places[row] = np.nan
        for other in np.flatnonzero(located):
            shapes.places[row, other] = places[other]
            shapes.covs[row, other] = covs[other]


@njit(cache=True, error_model="numpy")
def carry_shape(
    shapes: LocatedShapes,
    memory: ShapeMemory,
    hand: Ints,
    row: int,
    span_s: float,
    found: Bools,
    now: tuple[float, Array, Array],
    out: tuple[Array, Array],
) -> bool:
    """Where the landmark `row` is by its last shape: to out (3,), (3, 3).

    hand (L,): whose each landmark is; memory: what was learnt in spans of span_s; found (L,): what
    has a place now; now: the instant, and all places (L, 3) and covariances (L, 3, 3), those that
    one camera sees with a large variance along its ray. False if no shape says anything.
    """
    time_s, places, covs = now
    age_s = time_s - shapes.time_s[row]
    known = found & (hand == hand[row]) & np.isfinite(shapes.places[row, :, 0])
    rows = np.flatnonzero(known)
    if not age_s >= 0.0 or rows.size < LEAST or not known[row]:
        return False
    deformed = np.empty(rows.size)
    for n in range(rows.size):
        rate = max(TIMES * np.sqrt(memory.deformed[rows[n]]) / span_s, LEAST_RATE_M_S)
        far = rate * age_s
        deformed[n] = 1.0 / (1.0 / (far * far + 1e-12) + 1.0 / FARTHEST_M**2)
    moved, moved_covs = places[rows], covs[rows]
    hold_shape(deformed, shapes.places[row][rows], shapes.covs[row][rows], moved, moved_covs)
    for n in range(rows.size):
        if rows[n] == row:
            out[0][:] = moved[n]
            out[1][:] = moved_covs[n]
    return True
