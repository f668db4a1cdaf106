"""From located paint to the landmarks that it stands for (paint_to_bone.py); compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.output.paint_centroid import expected_shift

# Sigmas that are left along the viewing ray and along each axis across it, in radii of the paint,
# from the figures above.
SIGMA_UNKNOWN = (0.29, 0.16)
# With the solver's directions, beside what their own uncertainty makes (paint_centroid.py), along
# and across: SIDE of a finger seen from the side, and END times a power of the cosine between
# finger and viewing ray. Errors of rendered tips at .5-.7 m with directions 7 deg off, all causes:
# .4-.6 and .13 mm from the side, .7 and .25 at a cosine of -.6, 1.4-2.2 and .4-.5 pointing at the
# cameras, where the visible end depends on the direction most.
SIGMA_SIDE = (0.02, 0.012)
SIGMA_END, _END_POWER = (0.2, 0.08), (4, 2)
# Of a dab, in every direction, as a share of its diameter: rendered wrists (16 mm) lie 1.45 mm
# deep, of which their sag explains 1.58.
SIGMA_DAB = 0.025
# A finger turns by up to 10 rad/s: an older direction is worth no more than none.
_POSE_AGE_NS = 150_000_000
# A stamp that is older than any.
LONG_AGO_NS = -_POSE_AGE_NS - 1


class KnownPaint(NamedTuple):
    """The paint of L landmarks, and where the fingers pointed that a pose told of last."""

    radii_m: Array  # (L,) of painted tips, 0 for dabs
    dabs_m: Array  # (L,) diameters of dabs, 0 for painted tips
    sags_m: Array  # (L,) how deep a dab's middle lies under the landmark
    tables: Array  # (L, 61) shifts of tips (paint_centroid.py)
    radius_sds: Array  # (L,) how unsure the radius is, as a share
    directions: Array  # (L, 3) of a tip, or of the skin under a dab
    direction_sigmas: Array  # (L,) rad
    stamps_ns: Ints  # (L,) of the pose that told it
    viewpoint_rig: Array  # (3,) the middle of the cameras, which stands for all of them


@njit(cache=True)
def note_directions(
    paint: KnownPaint, rows: Ints, directions: Array, sigmas_rad: Array, stamp_ns: int
) -> None:
    """Remember which way the fingers of landmarks (n,) point: (n, 3), as sure as (n,)."""
    for n in range(rows.size):
        paint.directions[rows[n]] = directions[n]
        paint.direction_sigmas[rows[n]] = sigmas_rad[n]
        paint.stamps_ns[rows[n]] = stamp_ns


@njit(cache=True)
def correct_paint(
    paint: KnownPaint,
    instant_ns: int,
    positions: Array,
    covariances: Array,
    seen_by: Bools,
    cameras: Extrinsics,
) -> None:
    """Landmarks (L, 3), (L, 3, 3) from located paint centres at an instant, in place.

    seen_by (L, C) tells which cameras located them.
    """
    shift, shift_covariance = np.empty(3), np.empty((3, 3))
    for row in range(positions.shape[0]):
        ray = positions[row] - paint.viewpoint_rig  # away
        ray /= max(math.sqrt(ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2), 1e-9)
        along, across = SIGMA_UNKNOWN  # in radii
        if not abs(instant_ns - paint.stamps_ns[row]) <= _POSE_AGE_NS:
            # Skin that a camera sees faces it, more or less.
            positions[row] -= paint.sags_m[row] * ray
        elif paint.radii_m[row] == 0.0:
            positions[row] += paint.sags_m[row] * paint.directions[row]
        else:
            # A tip, whose middle has no depth under it.
            finger = paint.directions[row], paint.direction_sigmas[row], paint.radius_sds[row]
            chosen = _locating(cameras, seen_by[row])
            place, table = positions[row], paint.tables[row]
            if expected_shift(table, place, finger, chosen, shift, shift_covariance):
                positions[row] -= shift
                covariances[row] += shift_covariance
                along, across = _tip_sigmas(ray @ paint.directions[row])
        dab = (SIGMA_DAB * paint.dabs_m[row]) ** 2
        along = (along * paint.radii_m[row]) ** 2 + dab
        across = (across * paint.radii_m[row]) ** 2 + dab
        for i in range(3):
            for j in range(3):
                both = ray[i] * ray[j]
                covariances[row, i, j] += along * both + across * ((1.0 if i == j else 0.0) - both)


@njit(cache=True)
def _locating(cameras: Extrinsics, seen_by: Bools) -> Extrinsics:
    """The cameras that locate a landmark: those that see it (C,), all where less than two do."""
    count = np.count_nonzero(seen_by)
    if count < 2 or count == seen_by.size:
        return cameras
    chosen = np.flatnonzero(seen_by)
    return Extrinsics(cameras.R[chosen], cameras.t[chosen])


@njit(cache=True)
def _tip_sigmas(cosine: float) -> tuple[float, float]:
    """Sigmas along and across the viewing ray, in radii, of a tip whose direction is known.

    cosine: of the angle between finger and viewing ray.
    """
    return (
        math.hypot(SIGMA_SIDE[0], SIGMA_END[0] * cosine ** _END_POWER[0]),
        math.hypot(SIGMA_SIDE[1], SIGMA_END[1] * cosine ** _END_POWER[1]),
    )
