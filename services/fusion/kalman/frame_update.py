"""A frame taken into a hand's history, and landmarks that are lost: all of it in one compiled call.

Numpy's small calls from Python would cost as much as the filter: two thirds of a frame's time.
Compiled; nothing here raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.filtering import (
    complete_newest,
    filter_from,
    filter_inserted,
    insert_frame,
    oldest_with,
)
from services.fusion.kalman.history import HandHistory, forget_models, start_history
from services.fusion.kalman.motion.motion_models import MotionModels

# What one camera alone has seen for longer is forgotten: by then its distance says nothing.
ONE_CAMERA_S = 2.0
# A landmark that two cameras have seen lately and whose sigma is above both, absolutely and against
# the median of its hand, begins again with no fewer looks: from any number, with a fifth of the
# markers missing, it began up to 437 mm off.
#
# One that another camera has seen alone begins again where its sigma is above the former: its hand
# may have told all the while where it was, better than two looks do. (With a fifth of the markers
# of a smooth motion missing, one that was known to 4 mm began 204 mm off. Points 50 mm and six
# sigmas off, of motions like the tuning half's with gaps: with any sigma 47, from .005 on 49, from
# .01 42, from .02 45, from .03 63.) Where one look of each camera is not to be had at once, within
# RESTART_WINDOW_S: what a single look makes of a place decimetres off is not near enough to go on
# from (42 -> 35).
RESTART_WINDOW_S = 0.1
ASTRAY_SIGMA_M, ASTRAY_RATIO, ASTRAY_LOOKS = 0.01, 3.0, 6


class Sights(NamedTuple):
    """When each landmark was seen last by each camera; -inf: never."""

    accepted_s: Array  # (N, C) an observation that was used
    observed_s: Array  # (N, C) any observation
    begun_s: Array  # (N,) when it began last
    returned_s: Array  # (N,) when a second camera saw it again, unsure as it was by then
    hold_s: Array  # (1,) so long a landmark stays that nobody sees


def no_sights(landmarks: int, cameras: int, hold_s: Array) -> Sights:
    """Of landmarks that were never seen."""
    by_camera, each = (landmarks, cameras), (landmarks,)
    accepted, observed, begun, returned = (
        np.full(shape, -np.inf) for shape in (by_camera, by_camera, each, each)
    )
    return Sights(accepted, observed, begun, returned, hold_s)


class FrameLooks(NamedTuple):
    """A frame's n looks."""

    camera: int
    landmarks: Ints  # (n,)
    times_s: Array  # (n,)
    rays: Array  # (n, 2)
    sigmas: Array  # (n,) of each ray coordinate
    clock_variance: float  # s^2


class Fates(NamedTuple):
    """What became of the looks at N landmarks in a frame; take_in fills it, each time anew."""

    alive: Bools  # (N,) the landmark has an estimate
    used: Bools  # (N,) the look updated it
    back: Bools  # (N,) another camera saw it alone for hold_s, it got unsure, and has not begun yet
    astray: Bools  # (N,) it is known much worse than its hand
    counts: Ints  # (3,) of landmarks that ended before, of looks used, of looks at those alive


def no_fates(landmarks: int) -> Fates:
    """To be filled by take_in."""
    flags = np.zeros((4, landmarks), dtype=np.bool_)
    return Fates(flags[0], flags[1], flags[2], flags[3], np.zeros(3, dtype=np.int64))


# What take_in says of a frame: it is older than all that is remembered, and counts for nothing; all
# of it fits; or landmarks may have to begin, as the fates say.
LATE, FITS, UNUSUAL = 0, 1, 2


@njit(cache=True, error_model="numpy")
def take_in(
    history: HandHistory,
    sights: Sights,
    cameras: Extrinsics,
    filters: tuple[MotionModels, float],
    looks: FrameLooks,
    fates: Fates,
) -> int:
    """Filter a frame, and later ones anew; filters: the models, and the gate.

    Of the newest one, models that say nothing yet may be left to complete_newest.
    """
    complete_newest(history, cameras, filters)
    time_s = looks.times_s.mean()
    hold_s = sights.hold_s[0]
    _no_fate(fates)
    fates.counts[0] = drop_lost(history, sights, cameras, filters, time_s)
    if history.size[0] == 0:
        start_history(history, time_s - 1e-6)
    index = insert_frame(history, time_s, looks.camera, looks.clock_variance)
    if index < 0:
        return LATE
    node = history.order[index]
    history.looked[node] = False
    before = history.order[index - 1]
    _forget_who_was_away(history, before, time_s - hold_s)
    for n in range(looks.landmarks.size):
        k = looks.landmarks[n]
        history.looked[node, k] = True
        history.delay_s[node, k] = looks.times_s[n] - time_s
        history.ray[node, k] = looks.rays[n]
        history.ray_variance[node, k] = looks.sigmas[n] ** 2
        away_s = time_s - sights.accepted_s[k, looks.camera]
        alone_s = min(alone_since(sights, k, time_s), away_s)
        unsure = _largest_variance(history, before, k) > ASTRAY_SIGMA_M**2
        if unsure and alone_s > hold_s:
            sights.returned_s[k] = time_s
        back_s = time_s - sights.returned_s[k]
        fates.back[k] = back_s < min(RESTART_WINDOW_S, time_s - sights.begun_s[k])
    filter_inserted(history, index, cameras, filters)
    for n in range(looks.landmarks.size):
        k, at_s = looks.landmarks[n], looks.times_s[n]
        fates.alive[k], fates.used[k] = history.alive[node, k], history.used[node, k]
        sights.observed_s[k, looks.camera] = max(sights.observed_s[k, looks.camera], at_s)
        if fates.used[k]:
            sights.accepted_s[k, looks.camera] = max(sights.accepted_s[k, looks.camera], at_s)
        fates.counts[1] += fates.used[k]
        fates.counts[2] += fates.alive[k]
    _find_astray(history, sights, looks, fates.astray)
    for n in range(looks.landmarks.size):
        k = looks.landmarks[n]
        if not fates.used[k] or fates.back[k] or fates.astray[k]:
            return UNUSUAL
    return FITS


@njit(cache=True, error_model="numpy")
def _forget_who_was_away(history: HandHistory, node: int, since_s: float) -> None:
    """How a hand moved says nothing of how it does once it is back, if nothing is newer."""
    if history.time_s[node] < since_s:
        forget_models(history, node)


@njit(cache=True, error_model="numpy")
def _no_fate(fates: Fates) -> None:
    """As no_fates makes them, in place."""
    fates.alive[:] = False
    fates.used[:] = False
    fates.back[:] = False
    fates.astray[:] = False
    fates.counts[:] = 0


@njit(cache=True, error_model="numpy")
def alone_since(sights: Sights, k: int, time_s: float) -> float:
    """How long all but one camera have not seen landmark k, s; 0 if no two ever did."""
    first_s, second_s = -np.inf, -np.inf
    for seen_s in sights.accepted_s[k]:
        if seen_s > first_s:
            first_s, second_s = seen_s, first_s
        elif seen_s > second_s:
            second_s = seen_s
    return time_s - second_s if second_s > -np.inf else 0.0


@njit(cache=True, error_model="numpy")
def drop_lost(
    history: HandHistory,
    sights: Sights,
    cameras: Extrinsics,
    filters: tuple[MotionModels, float],
    now_s: float,
) -> int:
    """End landmarks that no camera has seen for hold_s, or one alone for ONE_CAMERA_S; how many.

    One that a second camera has seen since, but nothing that fits, is lost after hold_s.
    """
    if history.size[0] == 0:
        return 0
    newest = history.order[history.size[0] - 1]
    hold_s, lost = sights.hold_s[0], 0
    for k in range(history.alive.shape[1]):
        shown = 0
        for seen_s in sights.observed_s[k]:
            shown += seen_s >= now_s - hold_s
        longest_s = hold_s if shown >= 2 else ONE_CAMERA_S
        kept = now_s - sights.accepted_s[k].max() <= hold_s
        kept &= alone_since(sights, k, now_s) <= longest_s
        if history.alive[newest, k] and not kept:
            history.ends[newest, k] = True
            lost += 1
    if lost and history.size[0] > 1:
        filter_from(history, history.size[0] - 1, cameras, filters)
    elif lost:
        for k in range(history.alive.shape[1]):
            history.alive[newest, k] &= not history.ends[newest, k]
    return lost


@njit(cache=True, error_model="numpy")
def _largest_variance(history: HandHistory, node: int, k: int) -> float:
    """Of landmark k's place along the rig's axes at a node, by the likeliest model, m^2."""
    likeliest = int(np.argmax(history.probability[node]))
    largest = 0.0
    for i in range(3 * k, 3 * k + 3):
        largest = max(largest, history.cov[node, likeliest, i, i])
    return largest


@njit(cache=True, error_model="numpy")
def _find_astray(history: HandHistory, sights: Sights, looks: FrameLooks, astray: Bools) -> None:
    """Which looks' landmarks are known much worse than their hand is; astray (N,) in place.

    Two cameras see them, and yet they are adrift along a ray: as each look fits by itself, no gate
    tells.
    """
    newest = history.order[history.size[0] - 1]
    count = history.alive.shape[1]
    now_s = history.time_s[newest]
    variances = np.full(count, np.inf)  # of those alive, the largest of each
    for k in range(count):
        if history.alive[newest, k]:
            variances[k] = _largest_variance(history, newest, k)
    known = np.sort(variances[np.isfinite(variances)])
    usual = 0.5 * (known[known.size // 2] + known[(known.size - 1) // 2]) if known.size else 0.0
    wide = max(ASTRAY_SIGMA_M**2, ASTRAY_RATIO**2 * usual)
    for n in range(looks.landmarks.size):
        k = looks.landmarks[n]
        seen_by = 0
        for seen_s in sights.accepted_s[k]:
            seen_by += seen_s >= now_s - RESTART_WINDOW_S
        settled = now_s - sights.begun_s[k] > RESTART_WINDOW_S
        astray[k] = history.alive[newest, k] and variances[k] > wide and settled and seen_by >= 2
        if astray[k]:
            found = oldest_with(history, k, looks.times_s.mean() - RESTART_WINDOW_S)
            astray[k] = found.size >= ASTRAY_LOOKS
