"""Constraints of the hand after Lin, Wu & Huang as RHOT section 3.1 quotes them: limits, couplings, habits.

Type I (limits of each joint, the middle finger's abduction fixed) are hard: they come from HandModel.limits_rad, and no output
leaves them. Type II (couplings) and type III (habits) are soft: each is a standard deviation in radians, so that measurements
weighed by theirs win where they say anything. Couplings are per person (HandModel: coupling, coupling_weight; weight 0 turns one
off). A hand that was never measured uses the tables of rhot/hand.py.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.hand import HandModel
from rhot.transforms import Array

# Standard deviation of DIP about ratio * PIP at weight 1. Real hands: DIP/PIP .68-.74 in strong flexion, .08-.47 relaxed
# (finger study, Fig. 7; the recorded OpenXR poses), i.e. 5 to 15 deg off 2/3 at a PIP of 30 deg.
_COUPLING_DEG = 5.0
# Neighbouring MCP joints bend together (type II, inter-finger): the difference of two neighbours' flexions. Weak: a pointing
# index or a piano player's fingers differ by 40 deg.
_NEIGHBOUR_DEG = 30.0
# Habitual posture (type III): mean and standard deviation of (abduction, flexions). Means are those of a relaxed hand, rounded;
# the deviations leave a third of every joint's range at each side.
_FINGER_REST_DEG = ((0.0, 7.0), (32.0, 27.0), (42.0, 33.0), (28.0, 24.0))
_THUMB_REST_DEG = ((2.0, 13.0), (2.0, 16.0), (22.0, 18.0), (22.0, 24.0))


class Habit(NamedTuple):
    """What is believed of a hand's angles before it is seen: a Gaussian; radians, angles in the order of (5, 4) flattened."""

    mean: Array  # (20,)
    information: Array  # (20, 20)
    covariance: Array  # (20, 20)


def habit(model: HandModel) -> Habit:
    """All soft constraints of a person's hand as one Gaussian over its 20 angles.

    Each soft constraint is one row a.q = b with a standard deviation s: information a a'/s^2 (Gauss-Markov).
    """
    rest = np.deg2rad(np.array([_THUMB_REST_DEG, *(_FINGER_REST_DEG,) * 4]))
    limits = model.limits_rad
    information, pull = np.zeros((20, 20)), np.zeros(20)

    def add(terms: dict[int, float], value: float, sigma: float) -> None:
        row = np.zeros(20)
        for index, factor in terms.items():
            row[index] = factor
        information[:] += np.outer(row, row) / sigma**2
        pull[:] += row * value / sigma**2

    for row, digit in enumerate(model.digits):
        mean = np.clip(rest[row, :, 0], limits[row, :, 0], limits[row, :, 1])
        for j in range(4):
            add({4 * row + j: 1.0}, float(mean[j]), float(rest[row, j, 1]))
        if digit.coupling_weight > 0.0:
            add({4 * row + 3: 1.0, 4 * row + 2: -digit.coupling}, 0.0, float(np.deg2rad(_COUPLING_DEG)) / digit.coupling_weight)
    for row in range(1, 4):
        add({4 * row + 1: 1.0, 4 * row + 5: -1.0}, 0.0, float(np.deg2rad(_NEIGHBOUR_DEG)))
    covariance = np.linalg.inv(information)
    return Habit(mean=covariance @ pull, information=information, covariance=0.5 * (covariance + covariance.T))


@njit(cache=True)
def clamp(q: Array, limits: Array) -> None:
    """Bring q (n,) into limits (n, 2) in place; what is not finite goes to mid-range."""
    for j in range(q.size):
        low, high = limits[j, 0], limits[j, 1]
        # Nearly always true, and never for what is not a number.
        if not low <= q[j] <= high:
            q[j] = min(max(q[j], low), high) if np.isfinite(q[j]) else 0.5 * (low + high)
