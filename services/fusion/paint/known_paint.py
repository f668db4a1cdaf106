"""From located paint to the landmarks that it stands for (paint_to_bone.py); compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Layout, unowned
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.paint.paint_centroid import Finger, cross, expected_shift

# Sigmas that are left along the viewing ray and along each axis across it, in radii of the paint,
# from the figures above.
SIGMA_UNKNOWN = (0.29, 0.16)
# With the solver's directions, beside what their own uncertainty makes (paint_centroid.py), along
# and across: SIDE of a finger seen from the side, and END times a power of the cosine between
# finger and viewing ray, where little of the paint shows. What directions do not explain of tips of
# hands that are known exactly, playing at .5 m and moving at .7: across .03-.05 radii beyond a
# cosine of -.8, along .06-.15; less than .02 and nothing from the side.
SIGMA_SIDE = (0.02, 0.012)
SIGMA_END, _END_POWER = (0.1, 0.035), (4, 2)
# A shape that is unlike the model's counts so much more along the viewing ray than across it, as
# what is left does (SIGMA_UNKNOWN: 1.8 times).
_SHAPE_ALONG = 2.0
# The outline of a dab is drawn by hand, and counts so much more beside it. (Errors of the other
# renderer's tuning clips beside the wrist are .3 to .8 mm, told .35 to .45 with 1.)
_SHAPE_OF_DAB = 1.7
# Light falls on the side that cameras see: tips are located so much before their axis, in radii
# (tuning captures: .01 to .06; without, depths are 3 % worse).
_LIT = 0.025
# Of the skin under a dab whose direction nobody tells: what a camera sees faces it, more or less.
SIGMA_FACING_RAD = 0.5
# A finger turns by up to 10 rad/s: an older direction is worth no more than none.
POSE_AGE_NS = 150_000_000
# What turned faster from one pose to the next jumped to another posture, and does not turn on.
_MOST_TURN_RAD_S = 20.0
# A direction that is less sure than that says less than none: some of those that it may be would
# hide the paint. Closing hands a tenth larger than told, 95 % and maximum at no lag: 4.6 and 13 mm
# with 1.0, 3.3 and 8.1 with .6, 3.5 and 8.7 with .45; a recorded wave 10.4, 10.4 and 10.1. Of the
# other renderer's tuning half, RMS at lag 2 with .4, .5, .6 and .8: splay 2.69, 2.45, 2.27, 2.23,
# flapping 2.80, 2.57, 2.50, 2.49.
MOST_UNSURE_RAD = 0.6
# A stamp that is older than any.
LONG_AGO_NS = -POSE_AGE_NS - 1


class KnownPaint(NamedTuple):
    """The paint of L landmarks, and where the fingers pointed that a pose told of last."""

    radii_m: Array  # (L,) of painted tips, 0 for dabs
    sags_m: Array  # (L,) how deep a dab's middle lies under the landmark
    shifts_m: Array  # (L, 61) of tips (visible_paint.py)
    areas_m2: Array  # (L, 61) of tips, as they show (visible_paint.py)
    radius_sds: Array  # (L,) how unsure the radius of a finger or limb is, as a share
    directions: Array  # (L, 3) of a tip, or of the skin under a dab
    hinges: Array  # (L, 3) the axis about which the tip bends, across its direction
    direction_sigmas: Array  # (L, 2) rad, about the hinge and sideways, as the pose told
    misfits: Array  # (L,) how badly that pose's hand fits its bones (HandPose.model_misfit)
    direction_shares: Array  # (L,) of the sigmas that are believed, as areas say (area_scatter.py)
    shape_sds: Array  # (L,) how unlike the model's paint may be, in radii, as areas say
    hands: Ints  # (L,) which hand each is of, from 0; -1: its paint is as the model has it
    turns_rad_s: Array  # (L, 3) how a direction turned from the pose before that one
    stamps_ns: Ints  # (L,) of the pose that told it
    viewpoint_rig: Array  # (3,) the middle of the cameras, which stands for all of them


PAINT = Layout()
_paint_at = PAINT.at


@njit(cache=True)
def note_directions(
    address: int,
    rows: Ints,
    directions: Array,
    hinges: Array,
    sigmas_rad: Array,
    misfit: float,
    stamp_ns: int,
) -> None:
    """Remember, in KnownPaint at an address, how fingers of landmarks (n,) point and bend (n, 3).

    sigmas_rad (n, 2): how sure that is; misfit: of the pose.
    """
    paint: KnownPaint = _paint_at(address)
    for n in range(rows.size):
        row = rows[n]
        passed_s = 1e-9 * (stamp_ns - paint.stamps_ns[row])
        paint.turns_rad_s[row] = 0.0
        if 0.0 < passed_s <= 1e-9 * POSE_AGE_NS:
            _note_turn(paint.directions[row], directions[n], passed_s, paint.turns_rad_s[row])
        paint.directions[row] = directions[n]
        paint.hinges[row] = hinges[n]
        paint.direction_sigmas[row] = sigmas_rad[n]
        paint.misfits[row] = misfit
        paint.stamps_ns[row] = stamp_ns


@njit(cache=True)
def _note_turn(before: Array, now: Array, passed_s: float, turn_rad_s: Array) -> None:
    """How a direction (3,) turned in passed_s on average, rad/s to (3,); 0 if it jumped."""
    cross(before, now, turn_rad_s)
    sine = math.sqrt(turn_rad_s[0] ** 2 + turn_rad_s[1] ** 2 + turn_rad_s[2] ** 2)
    known = sine <= _MOST_TURN_RAD_S * passed_s
    for i in range(3):
        turn_rad_s[i] = turn_rad_s[i] / passed_s if known else 0.0


@njit(cache=True)
def _aim(paint: KnownPaint, row: int, instant_ns: int, aim: Array) -> None:
    """Where a landmark's direction and hinge point at an instant, to aim (2, 3).

    They turn on as they turned between the last two poses: a pose is a frame or two old when points
    rest on it.
    """
    direction, hinge = aim
    age_s = 1e-9 * (instant_ns - paint.stamps_ns[row])
    turn_on(paint.directions[row], paint.turns_rad_s[row], age_s, direction)
    along = 0.0
    for i in range(3):
        along += paint.hinges[row, i] * direction[i]
    for i in range(3):
        hinge[i] = paint.hinges[row, i] - along * direction[i]
    _make_unit(hinge)


@njit(cache=True)
def turn_on(direction: Array, turn_rad_s: Array, seconds: float, out: Array) -> None:
    """Where a direction (3,) points that turned on for so long; to out (3,)."""
    cross(turn_rad_s, direction, out)
    for i in range(3):
        out[i] = direction[i] + seconds * out[i]
    _make_unit(out)


@njit(cache=True)
def _make_unit(v: Array) -> None:
    """Make a vector (3,) one of unit length, in place; zeros stay."""
    length = max(math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2), 1e-9)
    for i in range(3):
        v[i] /= length


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
    located = positions, covariances, seen_by
    work = np.empty(3), np.empty((3, 3)), np.empty((2, 3))
    _correct(paint, instant_ns, cameras, located, work)


@njit(cache=True)
def _correct(
    paint: KnownPaint,
    instant_ns: int,
    cameras: Extrinsics,
    located: tuple[Array, Array, Bools],
    work: tuple[Array, Array, Array],
) -> None:
    """The same, of positions, covariances and seen_by; work (3,), (3, 3), (2, 3): memory."""
    positions, covariances, seen_by = unowned(located)
    shift, shift_covariance, aim = unowned(work)
    for row in range(positions.shape[0]):
        sigmas_rad = paint.direction_shares[row] * paint.direction_sigmas[row]
        ray = positions[row] - paint.viewpoint_rig  # away
        ray /= max(math.sqrt(ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2), 1e-9)
        is_told = abs(instant_ns - paint.stamps_ns[row]) <= POSE_AGE_NS
        is_told &= paint.direction_sigmas[row, 0] <= MOST_UNSURE_RAD
        if is_told:
            _aim(paint, row, instant_ns, aim)
        if paint.radii_m[row] == 0.0:
            normal, sigma_rad, shape = -ray, SIGMA_FACING_RAD, 0.0
            if is_told:
                normal, sigma_rad = aim[0], sigmas_rad[0]
                shape = paint.shape_sds[row]
            # Deeper than the skin, by as much as the limb is thinner.
            sag_m = paint.sags_m[row]
            positions[row] += sag_m * normal
            along = math.hypot(paint.radius_sds[row], _SHAPE_ALONG * shape)
            sigmas = along * sag_m, math.hypot(sigma_rad, _SHAPE_OF_DAB * shape) * sag_m
            _add_about(normal, sigmas, covariances[row])
            continue
        along, across = SIGMA_UNKNOWN  # in radii
        if is_told:
            # A tip, whose middle has no depth under it.
            finger = Finger(aim[0], aim[1], sigmas_rad, paint.radius_sds[row])
            chosen = _locating(cameras, seen_by[row])
            place, table = positions[row], paint.shifts_m[row]
            if expected_shift(table, place, finger, chosen, shift, shift_covariance):
                positions[row] += _LIT * paint.radii_m[row] * ray - shift
                covariances[row] += shift_covariance
                along, across = _tip_sigmas(ray @ aim[0])
                shape = paint.shape_sds[row]
                along, across = math.hypot(along, _SHAPE_ALONG * shape), math.hypot(across, shape)
        radius_m = paint.radii_m[row]
        _add_about(ray, (along * radius_m, across * radius_m), covariances[row])


@njit(cache=True)
def _add_about(axis: Array, sigmas: tuple[float, float], cov: Array) -> None:
    """Add to cov (3, 3) the squares of sigmas (along, across) a unit axis (3,)."""
    along, across = sigmas[0] ** 2, sigmas[1] ** 2
    for i in range(3):
        cov[i, i] += across
        for j in range(3):
            cov[i, j] += (along - across) * axis[i] * axis[j]


@njit(cache=True)
def _locating(cameras: Extrinsics, seen_by: Bools) -> Extrinsics:
    """The cameras that locate a landmark: those that see it (C,), all where less than two do."""
    count = np.count_nonzero(seen_by)
    if count < 2 or count == seen_by.size:
        return Extrinsics(cameras.R, cameras.t)
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
