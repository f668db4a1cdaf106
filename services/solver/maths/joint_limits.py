"""Keep joint angles within their limits, whatever comes in.

The limits themselves are in the hand model: rhot.hand.Digit.limits_rad, from rhot/hand_tables.py
for a hand that was never measured.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array


@njit(cache=True)
def clamp_to_limits(q: Array, limits: Array) -> None:
    """Bring q (n,) into limits (n, 2) in place; what is not finite goes to mid-range."""
    for j in range(q.size):
        low, high = limits[j, 0], limits[j, 1]
        # Nearly always true, and never for what is not a number.
        if not low <= q[j] <= high:
            q[j] = min(max(q[j], low), high) if np.isfinite(q[j]) else 0.5 * (low + high)
