"""Constraints of the hand after Lin, Wu & Huang as RHOT section 3.1 quotes them: limits, couplings,
habits.

Type I (limits of each joint, the middle finger's abduction fixed) are hard: they come from
HandModel.limits_rad, and no output leaves them. Type II (couplings) and type III (habits) are soft:
each is a standard deviation in radians, so that measurements weighed by theirs win where they say
anything. DIP follows PIP per person (HandModel: coupling, coupling_weight; weight 0 turns it off).
Between fingers the coupling is that they close together: what all MCP and all PIP joints share is
believed to vary much, each finger's own part less (the first synergy of Santello, Flanders &
Soechting, J. Neurosci. 18(23), 1998). Wrist and tips leave open which way the palm is pitched;
without this a closing fist looks like four fingers in four unlikely postures, or like a hand that
turns. A hand that was never measured uses the tables of rhot/hand.py.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import HandModel

# Standard deviation of DIP about ratio * PIP at weight 1. Real hands: DIP/PIP .68-.74 in strong
# flexion, .08-.47 relaxed (finger study, Fig. 7; the recorded OpenXR poses), i.e. 5 to 15 deg off
# 2/3 at a PIP of 30 deg.
_COUPLING_DEG = 5.0
# The thumb's IP joint about ratio * MCP: off by -4, 2 and 13 deg in the recorded OpenXR poses. At 5
# deg a thumb that bends on its own turns the whole hand (orientation error 3.8 deg, 3.4 at 15;
# simulated hands, 1 mm); one that follows loses nothing.
_THUMB_COUPLING_DEG = 15.0
# Habitual posture (type III): mean of (abduction, flexions), of a relaxed hand, rounded, and each
# joint's own standard deviation. The recorded Leap fist, pinch and wave differ less between fingers
# (MCP 1 to 13, PIP 1 to 6 deg); a hand that points differs more.
_FINGER_REST_DEG = ((0.0, 7.0), (32.0, 20.0), (42.0, 22.0), (28.0, 24.0))
_THUMB_REST_DEG = ((2.0, 13.0), (2.0, 16.0), (22.0, 18.0), (22.0, 24.0))
# What the fingers share, beside that: standard deviation of all MCP joints together and of all PIP
# joints (DIP in its ratio), and how the two go together. From open to fist, MCP 8 to 84 and PIP 12
# to 104 deg, is 3 deviations each. Shared deviations of 30 and 35 or own ones of 15 to 22 change
# the simulated scenes by less than 10 %; a correlation of .8 costs 10 % of flexion error, and a
# looser one lets a hand that is held still wander.
_SHARED_DEG, _SHARED_CORRELATION = (25.0, 30.0), 0.9


class Habit(NamedTuple):
    """What is believed of a hand's angles before it is seen: a Gaussian.

    Radians, angles in the order of (5, 4) flattened.
    """

    mean: Array  # (20,)
    information: Array  # (20, 20)
    covariance: Array  # (20, 20)
    # Directions in which the fingers close together, and how much of a posture lies along each (a
    # projection in the metric of information: shares @ together is the identity).
    together: Array  # (20, 2)
    shares: Array  # (2, 20)


def habit(model: HandModel) -> Habit:
    """All soft constraints of a person's hand as one Gaussian over its 20 angles.

    The coupling is one row a.q = b with a standard deviation s: information a a'/s^2
    (Gauss-Markov).
    """
    rest = np.deg2rad(np.array([_THUMB_REST_DEG, *(_FINGER_REST_DEG,) * 4]))
    limits, together = model.limits_rad, np.zeros((20, 2))
    for row, digit in enumerate(model.digits[1:], start=1):
        together[4 * row + 1, 0] = 1.0
        together[4 * row + 2 : 4 * row + 4, 1] = 1.0, digit.coupling
    shared = np.deg2rad(_SHARED_DEG)
    between = np.outer(shared, shared) * np.array(
        [[1.0, _SHARED_CORRELATION], [_SHARED_CORRELATION, 1.0]]
    )
    information = np.linalg.inv(
        np.diag((rest[:, :, 1] ** 2).ravel()) + together @ between @ together.T
    )
    pull = information @ np.clip(rest[:, :, 0], limits[:, :, 0], limits[:, :, 1]).ravel()
    for row, digit in enumerate(model.digits):
        coupled = np.zeros(20)
        coupled[4 * row + 3], coupled[4 * row + 2] = 1.0, -digit.coupling
        sigma = np.deg2rad(_THUMB_COUPLING_DEG if row == 0 else _COUPLING_DEG)
        information += np.outer(coupled, coupled) * (digit.coupling_weight / sigma) ** 2
    covariance = np.linalg.inv(information)
    shares = np.asarray(
        np.linalg.solve(together.T @ information @ together, together.T @ information),
        dtype=np.float64,
    )
    return Habit(
        covariance @ pull, information, 0.5 * (covariance + covariance.T), together, shares
    )


@njit(cache=True)
def clamp(q: Array, limits: Array) -> None:
    """Bring q (n,) into limits (n, 2) in place; what is not finite goes to mid-range."""
    for j in range(q.size):
        low, high = limits[j, 0], limits[j, 1]
        # Nearly always true, and never for what is not a number.
        if not low <= q[j] <= high:
            q[j] = min(max(q[j], low), high) if np.isfinite(q[j]) else 0.5 * (low + high)
