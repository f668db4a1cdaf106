"""How far landmarks lie from where the hand model has them, beyond what measuring explains.

A hand that was never measured has knuckles 1 to 4 cm from those of the tables. Believed to the
millimetre, tips of such a hand leave habit and past nothing to say: postures twist until the wrong
bones reach them, and jump from one contortion to the next. The misfit is one standard deviation
along each axis, the same for all landmarks, learned from what fits cost. A person's bones do not
change: it grows at once, and is forgotten slowly. A hand whose bones are right has none.
"""

from __future__ import annotations

import math

from numba import njit

from rhot.geometry.transforms import Array

# A fit costs this much per coordinate where the model is right (18 coordinates fix as many of 26
# unknowns, priors the rest). Flexion error of simulated hands with 1 mm of noise: 3.71 deg without
# a misfit, 3.71 at .7, 3.72 at .5; jumps of the tables' bones over 20 deg (Leap, three recordings,
# markers on palm and wrist, some hidden in turn): 41 without, 12 at .7, 9 at .5.
_EXPECTED_COST = 0.5
# A single bad fit (a hand that jumps, an outlier) counts no more than this.
_MAX_RATIO = 4.0
# Time constants of growing and of forgetting. On the same recordings: forgotten as fast as learned
# (.5 s) 16 jumps, forgotten in 10 s 9.
_GROWTH_S, _FORGETTING_S = 0.2, 10.0
# The knuckles of real hands are at most 45 mm from the tables', which is 2 sigma of this.
_MAX_MISFIT_M2 = 0.02**2


@njit(cache=True)
def learned_misfit(misfit_m2: float, whitening: Array, cost: float, seconds: float) -> float:
    """The misfit (a variance, m^2) after a fit some seconds after the last one.

    whitening (m, 3, 3) of the landmarks fitted, with misfit_m2 in their variances; cost of the fit.
    """
    coordinates = 3 * whitening.shape[0]
    if coordinates == 0:
        return misfit_m2
    # The harmonic mean: what is known badly (along one camera's ray) says nothing of the model.
    variance_m2 = coordinates / (whitening * whitening).sum()
    ratio = min(cost / (_EXPECTED_COST * coordinates), _MAX_RATIO)
    target_m2 = misfit_m2 + (ratio - 1.0) * variance_m2
    time_s = _GROWTH_S if target_m2 > misfit_m2 else _FORGETTING_S
    learned_m2 = misfit_m2 + (1.0 - math.exp(-seconds / time_s)) * (target_m2 - misfit_m2)
    return min(max(learned_m2, 0.0), _MAX_MISFIT_M2)
