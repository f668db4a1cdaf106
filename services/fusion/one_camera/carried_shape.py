"""What one camera sees alone, by the shape that its hand had when two cameras saw it last.

One camera tells a landmark's direction and not its distance. But two cameras may still see others
of its hand. So the shape of the last instant at which two cameras saw the landmark is moved as one
piece onto what is known now, and the landmark is told between its ray and its place in that shape,
the less sure the longer its hand could deform (kept_shape.py learns how fast it does). Compiled;
nothing here raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.one_camera.kept_shape import LEAST, ShapeMemory, hold_shape

# How far a landmark's place in its hand wanders, 1 sigma: this many times as fast as it lately did,
# at least at this rate, and never more than so far; hold_shape counts its square kept_shape.TIMES
# fold. Tuning motions of benchmarks/one_camera.py, three tips hidden for .5 s, geometric mean of
# RMS: with 1.5, .06 m/s and .03 m 10.6 mm, with these 8.7.
PACE, LEAST_RATE_M_S, FARTHEST_M = 0.6, 0.03, 0.015
# So many of the hand two cameras must see. With none, its size in one picture would have to tell
# how far off it is, and fingers move: a second without a camera, held out, 53 mm RMS for 39.
ANCHORS = 2


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
    memory: tuple[ShapeMemory, float],
    hand: Ints,
    row: int,
    are: tuple[Bools, Bools],
    now: tuple[float, Array, Array],
    out: tuple[Array, Array],
) -> bool:
    """Where the landmark `row` is by its last shape: to out (3,), (3, 3).

    memory: how hands deformed lately, in spans of so many seconds; hand (L,): whose each landmark
    is; are: whom two cameras see now (L,), and whom one sees alone; now: the instant, and all
    places (L, 3) and covariances (L, 3, 3), of what one camera sees with a large variance along its
    ray. False if no shape tells anything.
    """
    (learnt, span_s), (located, alone), (time_s, places, covs) = memory, are, now
    age_s = time_s - shapes.time_s[row]
    mine = hand == hand[row]
    known = (located | alone) & mine & np.isfinite(shapes.places[row, :, 0])
    rows = np.flatnonzero(known)
    if not age_s >= 0.0 or rows.size < LEAST or not known[row]:
        return False
    if np.count_nonzero(located & mine) < ANCHORS:
        return False
    deformed = np.empty(rows.size)
    for n in range(rows.size):
        rate = max(PACE * np.sqrt(learnt.deformed[rows[n]]) / span_s, LEAST_RATE_M_S)
        far = rate * age_s
        deformed[n] = 1.0 / (1.0 / (far * far + 1e-12) + 1.0 / FARTHEST_M**2)
    moved, moved_covs = places[rows], covs[rows]
    hold_shape(deformed, shapes.places[row][rows], shapes.covs[row][rows], moved, moved_covs)
    for n in range(rows.size):
        if rows[n] == row:
            out[0][:] = moved[n]
            out[1][:] = moved_covs[n]
    return True
