"""All that stays the same of a person's hand in one array, for kernels that Python calls.

numba takes each array of a call apart anew, a tuple's too: .1 us each, twice that between messages.
A hand's are views of one array again, once a kernel has it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.chains import HandChains
from services.solver.whole_hand.posture_prior import PosturePrior

# Where the chains' numbers end and those of the prior on posture begin.
_CHAINS = 156


def fixed_numbers(chains: HandChains, posture: PosturePrior) -> Array:
    """Both in one row, field after field."""
    return np.concatenate([np.ravel(field) for field in (*chains, *posture)])


@njit(cache=True)
def chains_of(fixed: Array) -> HandChains:
    """The chains among `fixed_numbers`."""
    return HandChains(
        base_m=fixed[:15].reshape(5, 3),
        base_rotation=fixed[15:60].reshape(5, 3, 3),
        metacarpal_m=fixed[60:75].reshape(5, 3),
        lengths_m=fixed[75:90].reshape(5, 3),
        tool_m=fixed[90:105].reshape(5, 3),
        limits_rad=fixed[105:145].reshape(5, 4, 2),
        coupling=fixed[145:155].reshape(5, 2),
        side=fixed[155],
    )


@njit(cache=True)
def posture_of(fixed: Array) -> PosturePrior:
    """The prior on posture among `fixed_numbers`."""
    rest = fixed[_CHAINS:]
    return PosturePrior(
        mean=rest[:20],
        information=rest[20:420].reshape(20, 20),
        covariance=rest[420:820].reshape(20, 20),
        synergies=rest[820:860].reshape(20, 2),
        projection=rest[860:900].reshape(2, 20),
    )
