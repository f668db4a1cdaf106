"""When a distance stopped falling, or began to rise: the kink of a line that is flat on one side.

A finger comes at some speed, or slows down on its last millimetres, and stops at the surface,
wherever a biased measurement sees it; later it leaves from there. The instant shows in the shape of
the distance, which no bias moves, rather than in the distance itself. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array

# Kinks tried between two samples; the finest step is then 4 ms at 60 Hz.
_STEPS = 4
# How long the other side rises at most: a finger may set out just before it touches.
_RAMPS_S = (0.1, np.inf)
# Straight, or slowing down into the touch. Chosen on 47 hands of the simulator's grasp family (even
# seeds): with straight lines alone 95 % of begins are within 80 ms, with these within 51 ms.
_ARRIVAL_POWERS = (1.0, 1.5, 2.0)
# A finger leaves at once: with the same three, 95 % of ends were within 60 ms, not 45.
_DEPARTURE_POWERS = (1.0,)
# What touches is within these of where it rests, as skin gives: on the same hands, ends without it
# were 10 ms early, and 95 % within 55 ms, not 45.
_ARRIVAL_M, _DEPARTURE_M = 0.0006, 0.0005


class Kink(NamedTuple):
    """time_s of the kink, the level of the flat side, and how far the other one rises from it."""

    time_s: float
    level_m: float
    rise_m: float


def arrival(times_s: Array, values_m: Array) -> Kink | None:
    """The best falling-then-flat line through n >= 4 samples (n,); None if nothing falls."""
    found = _rise(-times_s[::-1], values_m[::-1], _ARRIVAL_POWERS, _ARRIVAL_M)
    return None if found is None else found._replace(time_s=-found.time_s)


def departure(times_s: Array, values_m: Array) -> Kink | None:
    """The best flat-then-rising line through n >= 4 samples (n,); None if nothing rises."""
    return _rise(times_s, values_m, _DEPARTURE_POWERS, _DEPARTURE_M)


def _rise(times_s: Array, values_m: Array, powers: tuple[float, ...], edge_m: float) -> Kink | None:
    """level + slope * (time since the kink) ** power, by least squares over kinks and powers.

    The kink's time is that at which the fitted line is edge_m above its level.
    """
    if len(times_s) < 4:
        return None
    # At least the last sample rises, and at least the first is flat.
    knots = np.interp(
        np.linspace(0.0, len(times_s) - 2.0, _STEPS * (len(times_s) - 2) + 1),
        np.arange(len(times_s)),
        times_s,
    )
    after = np.maximum(0.0, times_s - knots[:, None])  # (k, n)
    shapes = [(power, ramp_s) for power in powers for ramp_s in _RAMPS_S]
    along = np.concatenate([np.minimum(after, ramp_s) ** power for power, ramp_s in shapes])
    centred = along - along.mean(axis=1, keepdims=True)
    own = values_m - values_m.mean()
    variance = np.einsum("kn,kn->k", centred, centred)
    slope = centred @ own / variance
    left = own @ own - slope * slope * variance
    best = int(np.argmin(np.where(slope > 0.0, left, np.inf)))
    (power, ramp_s), knot_s = shapes[best // len(knots)], float(knots[best % len(knots)])
    lasts_s = min(ramp_s, float(times_s[-1]) - knot_s)
    rise_m = float(slope[best]) * lasts_s**power
    # A micrometre: rounding, no motion.
    if not rise_m > 1e-6:
        return None
    level_m = float(values_m.mean() - slope[best] * along[best].mean())
    later_s = min((edge_m / float(slope[best])) ** (1.0 / power), lasts_s)
    return Kink(knot_s + later_s, level_m, rise_m)
