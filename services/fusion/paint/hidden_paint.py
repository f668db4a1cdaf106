"""Paint that is hidden in part: its centre is off, and depth with it where cameras see it unlike.

A finger before a tip leaves the tracker a sharp blob with little noise, whose centre is pixels away
from that of the whole. Neighbouring cameras see a marker alike unless something is in the way of
one of them: of rendered tips that both of two cameras (75 mm apart, .5 to .8 m away) see whole, the
areas differ by 7 % RMS. Where they differ by more, the smaller one counts as partly hidden, and its
centre as off by as much as an edge at any side of it may shift it. What hides a marker from all
cameras alike shifts all of them nearly alike: sideways more than in depth. That shows where a tip
is smaller than its direction lets expect (expected_area.py). What comes and goes in one camera
scatters its looks (unsteady_area.py). What the picture's edge cuts is off by all of its sigma.

Where the pose that points rest on has a finger before a tip (behind_fingers.py), it is known which
side is hidden: the look is put back to where the middle of the whole would be.

A painted finger tip looks up to so much smaller from another side; a dab on curved skin still more.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Layout
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.intake.observations import View
from services.fusion.paint.area_scatter import judge_hands, take_look
from services.fusion.paint.behind_fingers import hidden_from
from services.fusion.paint.expected_area import (
    AreaLook,
    against_pose,
    hidden_share,
    usually_less,
)
from services.fusion.paint.known_paint import POSE_AGE_NS, KnownPaint
from services.fusion.paint.unsteady_area import unsteady_sigma

# Logarithm of the ratio of areas that says nothing: on any rig, and for each radian between the
# cameras' rays, of tips and of dabs. Whole ones seen by two cameras .09 to .15 rad apart: within
# .128 and .307 in 95 % of 9900 looks (tuning captures; 200 tips of them partly hidden).
_ALIKE, _TIP_PER_RAD, _DAB_PER_RAD = 0.03, 0.6, 2.0
# Error of the centre against the root of the whole's area at a share hidden of 1. Disparities of
# these captures were .093 of it off RMS where the logarithm was .25-.5, .232 above, .017 below .05.
_SHIFT = 0.42
# The same of what a tip's direction lets expect. (Tuning half of our own pictures: with .5 NEES is
# about 4 % less. The filter is not told of this sigma: that made the other renderer's hand that
# grabs worse without lag, 4.96 -> 5.31 mm RMS, 27 -> 44 at most.)
_SHIFT_BY_POSE = 0.3
# Where the pose has a finger before a tip, its centre is put back by so much of the root of the
# whole's area at a share hidden of 1; what is left of what it may be off, and of that way. (The
# other renderer's tuning clips with true poses: looks of which 18 to 33 % less shows were off from
# the finger by 1.44 px RMS where another passes beside the middle, .17 less .48 of that; 9 to 18 %,
# .93 and .38. Both tuning halves: the same to 1 % with .6.)
_SHIFT_AWAY, _LEFT, _LEFT_OF_SHIFT = 0.48, 0.5, 0.3
# Another camera's look is compared with for so long, and a hidden marker counts on for so long.
_RECENT_S, _MEMORY_S = 0.1, 0.1


class PaintSeen(NamedTuple):
    """What C cameras saw last of the paint of L landmarks."""

    areas: Array  # (L, C) of each look, in the rays' units
    seen_s: Array  # (L, C) when, s since fusion's epoch
    levels: Array  # (L, C) logarithm of area over expected area of paint that shows whole
    # One standard deviation of each ray: its own, as others see more, and one that all share, as
    # all see less than the pose lets expect.
    sigmas: Array  # (2, L, C)
    # Mean and variance, of late, of the logarithm of an area's ratio to another camera's.
    ratios: Array  # (L, C, 2)
    # Of an area's ratio to its model's (area_scatter.py).
    ratio_sums: Array  # (L, C, 4)
    usual_ratios: Array  # (L, 2)
    # Where each landmark is, rig frame, m: written by who tells points; NaN where unknown.
    places: Array  # (L, 3)


class _Seen(NamedTuple):
    """All that a look is compared with."""

    seen: PaintSeen
    cameras: Extrinsics
    centres_rig: Array  # (C, 3) of the cameras
    per_rad: Array  # (L,) how fast areas differ with the angle between rays
    paint: KnownPaint


_SEEN = Layout()
_seen_at = _SEEN.at


class HiddenPaint:
    """How far every camera's sight of every landmark may be off: by the areas that all of them see,
    and by what poses let expect of tips.

    Landmarks without extent have no area.
    """

    def __init__(self, cameras: Extrinsics, round_paint: Bools, paint: KnownPaint) -> None:
        """round_paint (L,): painted all round, not a dab.

        paint: what its owner keeps up to date with poses; its direction_shares and
        shape_sds are told here.
        """
        per_rad = np.where(round_paint, _TIP_PER_RAD, _DAB_PER_RAD)
        shape = (len(per_rad), len(cameras.t))
        centres_rig = -np.einsum("cji,cj->ci", cameras.R, cameras.t)
        self.seen = PaintSeen(
            areas=np.empty(shape),
            seen_s=np.empty(shape),
            levels=np.empty(shape),
            sigmas=np.empty((2, *shape)),
            ratios=np.empty((*shape, 2)),
            ratio_sums=np.empty((*shape, 4)),
            usual_ratios=np.empty((shape[0], 2)),
            places=np.empty((shape[0], 3)),
        )
        self.paint = paint
        self._packed = _SEEN.pack(_Seen(self.seen, cameras, centres_rig, per_rad, paint))
        self.reset()

    def reset(self) -> None:
        """Time starts anew."""
        seen = self.seen
        seen.areas[:], seen.seen_s[:], seen.levels[:] = 0.0, -np.inf, np.nan
        seen.sigmas[:], seen.ratios[:], seen.places[:] = 0.0, np.nan, np.nan
        seen.ratio_sums[:], seen.usual_ratios[:] = 0.0, np.nan
        judge_hands(seen.ratio_sums, seen.usual_ratios, self.paint)

    def observe(self, view: View, time_s: float) -> Array:
        """What is to be added, squared, to a view's sigmas (n,).

        Its rays are moved, in place, to where the middle of what a finger hides would be.
        """
        found = np.empty(len(view.landmarks))
        _compare(
            self._packed.address,
            view.camera,
            view.instant_ns,
            time_s,
            view.landmarks,
            view.areas,
            np.where(view.cut, view.sigmas, 0.0),
            view.rays,
            found,
        )
        return found


@njit(cache=True)
def _compare(
    address: int,
    camera: int,
    instant_ns: int,
    time_s: float,
    landmarks: Ints,
    areas: Array,
    cut_sigmas: Array,
    rays: Array,
    out: Array,
) -> None:
    """Update what is seen of paint by a camera's look; to out the sigmas of its landmarks (n,).

    Rays (n, 2) are moved as HiddenPaint.observe says; cut_sigmas (n,): of those that the picture's
    edge cuts, else 0. address: of _Seen. What areas say of a hand's
    paint goes to its KnownPaint.
    """
    parts: _Seen = _seen_at(address)
    seen, centres, per_rad, paint = parts.seen, parts.centres_rig, parts.per_rad, parts.paint
    own, shared = seen.sigmas
    # How much less of each shows than its pose lets expect, its area to the model's and what
    # directions make of that (expected_area.AreaLook); the time since the look before, s.
    below, ratios, by_direction, passed_s = np.full((4, landmarks.size), np.nan)
    for n in range(landmarks.size):
        row = landmarks[n]
        passed_s[n] = max(time_s - seen.seen_s[row, camera], 0.0)
        seen.areas[row, camera], seen.seen_s[row, camera] = areas[n], time_s
        look = _take_area(parts, camera, row, instant_ns, passed_s[n])
        below[n], ratios[n], by_direction[n] = look.below, look.ratio, look.by_direction
    usual, away = usually_less(below), np.empty(2)
    view = parts.cameras.R[camera], parts.cameras.t[camera]
    for n in range(landmarks.size):
        row, keep = landmarks[n], math.exp(-passed_s[n] / _MEMORY_S)
        worst, more, whole = _unlike(seen, centres, per_rad[row], camera, row, time_s)
        hidden = hidden_share(below[n] - usual, paint.shape_sds[row])
        width = math.sqrt(areas[n] / (1.0 - hidden))
        by_pose = _SHIFT_BY_POSE * hidden * width
        some = more > _ALIKE or hidden > 0.0
        if some and hidden_from(paint, seen.places, row, instant_ns, view, away):
            share = max(1.0 - math.exp(_ALIKE - more), 0.0)
            off = _SHIFT_AWAY * max(share * math.sqrt(whole), hidden * width)
            rays[n, 0] -= off * away[0]
            rays[n, 1] -= off * away[1]
            worst = math.hypot(_LEFT * worst, _LEFT_OF_SHIFT * off)
            by_pose *= _LEFT
        # How far the whole reaches stays wrong for as long as the edge cuts it.
        worst = max(worst, cut_sigmas[n])
        if worst == 0.0 and not math.isnan(ratios[n]):
            sums = seen.ratio_sums[row, camera]
            take_look(sums, seen.usual_ratios[row], ratios[n], by_direction[n], passed_s[n])
        own[row, camera] = max(worst, keep * own[row, camera])
        shared[row, camera] = max(by_pose, keep * shared[row, camera])
        out[n] = math.hypot(own[row, camera], _unsteady(seen, camera, row, passed_s[n]))
    judge_hands(seen.ratio_sums, seen.usual_ratios, paint)


@njit(cache=True)
def _take_area(parts: _Seen, camera: int, row: int, instant_ns: int, passed_s: float) -> AreaLook:
    """A camera's look at a tip against its pose; NaN where none tells. Its level is taken on."""
    seen, paint = parts.seen, parts.paint
    age_ns = instant_ns - paint.stamps_ns[row]
    if not paint.areas_m2[row].any() or abs(age_ns) > POSE_AGE_NS:
        return AreaLook(math.nan, math.nan, math.nan, math.nan)
    sigmas_rad = paint.direction_sigmas[row]
    look = against_pose(
        seen.places[row] - parts.centres_rig[camera],
        paint.areas_m2[row],
        (paint.directions[row], paint.turns_rad_s[row], 1e-9 * age_ns),
        math.hypot(sigmas_rad[0], sigmas_rad[1]),
        seen.areas[row, camera],
        (seen.levels[row, camera], passed_s),
    )
    seen.levels[row, camera] = look.level
    return look


@njit(cache=True)
def _unsteady(seen: PaintSeen, camera: int, row: int, passed_s: float) -> float:
    """How far a look may be off in the rays' units, as its area flickers against another's."""
    seen_s, latest = seen.seen_s[row], -1
    for other in range(seen_s.size):
        fresh = other != camera and seen_s[camera] - seen_s[other] <= _RECENT_S
        if fresh and (latest < 0 or seen_s[other] > seen_s[latest]):
            latest = other
    area = seen.areas[row, camera]
    if latest < 0 or not (area > 0.0 and seen.areas[row, latest] > 0.0):
        return 0.0
    ratio = area / seen.areas[row, latest]
    return math.sqrt(area) * unsteady_sigma(seen.ratios[row, camera], ratio, passed_s)


@njit(cache=True)
def _unlike(
    seen: PaintSeen, centres: Array, per_rad: float, camera: int, row: int, time_s: float
) -> tuple[float, float, float]:
    """How far a camera's look at a landmark may be off, as others see more; 0 if none does.

    And how much more the one sees that sees most, as a logarithm, and the area that it would have
    here if this camera saw as much, in the rays' units; 0 and 0 if none sees more.
    """
    area, worst, place = seen.areas[row, camera], 0.0, seen.places[row]
    own = place - centres[camera]
    own_m = math.sqrt(own @ own)
    most, largest = 0.0, 0.0
    for other in range(centres.shape[0]):
        fresh = 0.0 <= time_s - seen.seen_s[row, other] <= _RECENT_S
        if other == camera or not fresh or area <= 0.0:
            continue
        away = place - centres[other]
        away_m = math.sqrt(away @ away)
        # Nothing without a place, which is NaN, or without a distance.
        if own_m * away_m > 0.0:
            cosine = min(max((own @ away) / (own_m * away_m), -1.0), 1.0)
            whole = seen.areas[row, other] * (away_m / own_m) ** 2
            more = math.log(whole / area)
            if more > most:
                most, largest = more, whole
            less = more - _ALIKE - per_rad * math.acos(cosine)
            if less > 0.0:
                worst = max(worst, _SHIFT * (1.0 - math.exp(-less)) * math.sqrt(whole))
    return worst, most, largest
