"""When a distance stopped falling, or began to rise: the kink of a line that is flat on one side.

A finger comes at some speed and stops at the surface, wherever a biased measurement sees it; later
it leaves from there. The instant shows as a kink, which no bias moves, rather than in the distance
itself. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array

# Kinks tried between two samples; the finest step is then 4 ms at 60 Hz.
_STEPS = 4
# How long the other side rises at most: a finger may set out just before it touches.
_RAMPS_S = (0.1, np.inf)


class Kink(NamedTuple):
    """time_s of the kink, the level of the flat side, and the slope of the other (> 0)."""

    time_s: float
    level_m: float
    speed_m_s: float


def arrival(times_s: Array, values_m: Array) -> Kink | None:
    """The best falling-then-flat line through n >= 4 samples (n,); None if nothing falls."""
    found = departure(-times_s[::-1], values_m[::-1])
    return None if found is None else found._replace(time_s=-found.time_s)


def departure(times_s: Array, values_m: Array) -> Kink | None:
    """The best flat-then-rising line through n >= 4 samples (n,); None if nothing rises."""
    if len(times_s) < 4:
        return None
    # At least the last sample rises, and at least the first is flat.
    knots = np.interp(
        np.linspace(0.0, len(times_s) - 2.0, _STEPS * (len(times_s) - 2) + 1),
        np.arange(len(times_s)),
        times_s,
    )
    after = np.maximum(0.0, times_s - knots[:, None])  # (k, n)
    along = np.concatenate([np.minimum(after, ramp_s) for ramp_s in _RAMPS_S])
    knots = np.tile(knots, len(_RAMPS_S))
    centred = along - along.mean(axis=1, keepdims=True)
    own = values_m - values_m.mean()
    power = np.einsum("kn,kn->k", centred, centred)
    slope = centred @ own / power
    left = own @ own - slope * slope * power
    best = int(np.argmin(np.where(slope > 0.0, left, np.inf)))
    # 1 um/s: rounding, no motion.
    if not slope[best] > 1e-6:
        return None
    level = values_m.mean() - slope[best] * along[best].mean()
    return Kink(float(knots[best]), float(level), float(slope[best]))
