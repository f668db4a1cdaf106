"""Paint of which one camera sees less than another: its centre is off there, and depth with it.

A finger before a tip leaves the tracker a sharp blob with little noise, whose centre is pixels away
from that of the whole. Neighbouring cameras see a marker alike unless something is in the way of
one of them: of rendered tips that both of two cameras (75 mm apart, .5 to .8 m away) see whole, the
areas differ by 7 % RMS. Where they differ by more, the smaller one counts as partly hidden, and its
centre as off by as much as an edge at any side of it may shift it. What hides a marker from all
cameras alike shifts all of them alike: sideways, not in depth; only the trackers can know that.

A painted finger tip looks up to so much smaller from another side; a dab on curved skin still more.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.intake.observations import View

# Logarithm of the ratio of areas that says nothing: on any rig, and for each radian between the
# cameras' rays, of tips and of dabs. Whole ones seen by two cameras .09 to .15 rad apart: within
# .128 and .307 in 95 % of 9900 looks (tuning captures; 200 tips of them partly hidden).
_ALIKE, _TIP_PER_RAD, _DAB_PER_RAD = 0.03, 0.6, 2.0
# Error of the centre against the root of the whole's area at a share hidden of 1. Disparities of
# these captures were .093 of it off RMS where the logarithm was .25-.5, .232 above, .017 below .05.
_SHIFT = 0.42
# Another camera's look is compared with for so long, and a hidden marker counts on for so long.
_RECENT_S, _MEMORY_S = 0.1, 0.1


class HiddenPaint:
    """How far every camera's sight of every landmark may be off, by the areas that all of them see.

    Landmarks without extent have no area.
    """

    def __init__(self, centres_rig: Array, round_paint: Bools) -> None:
        """centres_rig (C, 3) of the cameras; round_paint (L,): painted all round, not a dab."""
        self._centres = centres_rig
        self._per_rad = np.where(round_paint, _TIP_PER_RAD, _DAB_PER_RAD)
        self.reset()

    def reset(self) -> None:
        """Time starts anew."""
        shape = (len(self._per_rad), len(self._centres))
        self._areas, self._seen_s = np.zeros(shape), np.full(shape, -np.inf)
        # One standard deviation of each ray (L, C); where each landmark is (L, 3), which whoever
        # puts it there writes, NaN where that is unknown.
        self.sigmas = np.zeros(shape)
        self.places = np.full((shape[0], 3), np.nan)

    def observe(self, view: View, time_s: float) -> Array:
        """What is to be added, squared, to a view's sigmas (n,)."""
        found = np.empty(len(view.landmarks))
        _compare(
            self._areas,
            self._seen_s,
            self.sigmas,
            self.places,
            self._centres,
            self._per_rad,
            view.camera,
            time_s,
            view.landmarks,
            view.areas,
            found,
        )
        return found


@njit(cache=True)
def _compare(
    known: Array,
    seen_s: Array,
    sigmas: Array,
    places: Array,
    centres: Array,
    per_rad: Array,
    camera: int,
    time_s: float,
    landmarks: Ints,
    areas: Array,
    out: Array,
) -> None:
    """Update known areas, times and sigmas (L, C) by a look; to out the sigmas of its landmarks
    (n,).
    """
    for n in range(landmarks.size):
        row = landmarks[n]
        keep = math.exp(-max(time_s - seen_s[row, camera], 0.0) / _MEMORY_S)
        known[row, camera], seen_s[row, camera] = areas[n], time_s
        own = places[row] - centres[camera]
        own_m = math.sqrt(own @ own)
        worst = 0.0
        for other in range(centres.shape[0]):
            fresh = 0.0 <= time_s - seen_s[row, other] <= _RECENT_S
            if other == camera or not fresh or areas[n] <= 0.0:
                continue
            away = places[row] - centres[other]
            away_m = math.sqrt(away @ away)
            # Nothing without a place, which is NaN, or without a distance.
            if own_m * away_m > 0.0:
                cosine = min(max((own @ away) / (own_m * away_m), -1.0), 1.0)
                whole = known[row, other] * (away_m / own_m) ** 2
                less = math.log(whole / areas[n]) - _ALIKE - per_rad[row] * math.acos(cosine)
                if less > 0.0:
                    hidden = 1.0 - math.exp(-less)
                    worst = max(worst, _SHIFT * hidden * math.sqrt(whole))
        sigmas[row, camera] = max(worst, keep * sigmas[row, camera])
        out[n] = sigmas[row, camera]
