"""Closed form for a finger whose DIP follows PIP by a law of its own, line or parabola. Pure.

services/solver/finger/analytic.py solves the same for DIP = ratio * PIP, the law that a hand model
can have; here any law stands, since a person's has an intercept and bends. A test compares them.
The distance from MCP to tip depends on PIP alone: it is tabulated over PIP's range, and each place
where it crosses the distance asked for is refined; of several, the nearest to the last frame's
counts. MCP then turns the tip onto the target.
"""

from __future__ import annotations

import math

import numpy as np

from rhot.geometry.transforms import Array
from services.solver.finger.outcome import SOLVED, UNREACHABLE
from studies.grasp.planar import joints_of
from studies.grasp.recover.laws import Law

# Entries of the table; PIP's range of 125 deg in steps of 1 deg.
_TABLE = 126
# rad; refined until the bracket is as narrow. Seven steps of regula falsi and bisection by turns.
_NARROW_RAD = 1e-9


def solve_with_law(
    lengths: Array, limits: Array, law: Law, point: Array, start: Array, tolerance: float
) -> tuple[Array, int, float, int]:
    """Angles (3,), refinements used, distance left, SOLVED or UNREACHABLE.

    lengths (3,), limits (4, 2) rad, point (2,) in the plane, start (3,) the last frame's angles.
    """
    low, high = limits[2]
    table = np.linspace(low, high, _TABLE)
    far = math.hypot(point[0], point[1])
    excess = _reach(table, lengths, limits, law) - far
    found, used = [], 0
    for k in np.flatnonzero(np.diff(np.signbit(excess))).tolist():
        pip, steps = _refined(table[k], table[k + 1], far, lengths, limits, law)
        found.append(pip)
        used += steps
    if found:
        pip = min(found, key=lambda one: abs(one - start[1]))
        angles = _turned(np.array([pip]), point, lengths, limits, law)[0]
        left = _left(angles[None], point, lengths)[0]
        if left <= tolerance:
            return angles, used, float(left), SOLVED
    # Out of reach, or MCP at its limit: the nearest tip that the law allows.
    trials = _turned(table, point, lengths, limits, law)
    nearest = table[int(np.argmin(_left(trials, point, lengths)))]
    step = (high - low) / (_TABLE - 1)
    fine = np.clip(np.linspace(nearest - step, nearest + step, 201), low, high)
    trials = _turned(fine, point, lengths, limits, law)
    lefts = _left(trials, point, lengths)
    best = int(np.argmin(lefts))
    left = float(lefts[best])
    return trials[best], used, left, SOLVED if left <= tolerance else UNREACHABLE


def _straightened(pip: Array, limits: Array, law: Law) -> Array:
    """Angles (n, 3) at MCP 0 and PIP (n,)."""
    dip = np.clip(law.dip(pip), limits[3, 0], limits[3, 1])
    return np.column_stack([np.zeros_like(pip), pip, dip])


def _reach(pip: Array, lengths: Array, limits: Array, law: Law) -> Array:
    """Distance (n,) from MCP to tip at PIP (n,)."""
    tips = joints_of(_straightened(pip, limits, law), lengths)[:, 3]
    return np.hypot(tips[:, 0], tips[:, 1])


def _turned(pip: Array, point: Array, lengths: Array, limits: Array, law: Law) -> Array:
    """Angles (n, 3) at PIP (n,) whose tip lies towards the point, as far as MCP allows."""
    angles = _straightened(pip, limits, law)
    tips = joints_of(angles, lengths)[:, 3]
    turn = math.atan2(point[1], point[0]) - np.arctan2(tips[:, 1], tips[:, 0])
    low, high = limits[1]
    # Around the circle to the turn nearest to the middle of MCP's range.
    middle = 0.5 * (low + high)
    turn = (turn - middle + np.pi) % (2.0 * np.pi) - np.pi + middle
    angles[:, 0] = np.clip(turn, low, high)
    return angles


def _left(angles: Array, point: Array, lengths: Array) -> Array:
    gap = joints_of(angles, lengths)[:, 3] - point
    return np.hypot(gap[:, 0], gap[:, 1])


def _refined(
    low: float, high: float, far: float, lengths: Array, limits: Array, law: Law
) -> tuple[float, int]:
    """PIP between low and high at which the tip is `far` away; and the steps it took."""

    def excess(pip: float) -> float:
        return float(_reach(np.array([pip]), lengths, limits, law)[0]) - far

    at_low, at_high, steps = excess(low), excess(high), 0
    while high - low > _NARROW_RAD and steps < 60:
        chord = low - at_low * (high - low) / (at_high - at_low) if at_high != at_low else low
        middle = chord if steps % 2 == 0 and low < chord < high else 0.5 * (low + high)
        value, steps = excess(middle), steps + 1
        if value == 0.0:
            return middle, steps
        if (value > 0.0) == (at_low > 0.0):
            low, at_low = middle, value
        else:
            high, at_high = middle, value
    return 0.5 * (low + high), steps
