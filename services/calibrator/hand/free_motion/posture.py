"""What is known of the angles of a hand that moves as it likes: a Gaussian, and soft limits. Pure.

The same knowledge that the solver has (services/solver/whole_hand/priors/posture_prior.py): fingers
close together (Santello, Flanders & Soechting, J. Neurosci. 18(23), 1998), a last joint follows the
one before it. But how a person holds the hand, and how much moves, is learnt from the recording
with everything else (a mean of its own, and spreads): a prior that is sure of postures which this
person does not have turns into wrong bones.

The unknown angles of a frame are "own" ones: the last one of a digit is what it has beside coupling
times the one before it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HandModel

# (mean, standard deviation) of abduction and flexions, deg; of a last joint, about the coupling.
_FINGER_DEG = ((0.0, 8.0), (30.0, 24.0), (40.0, 26.0), (0.0, 4.0))
_THUMB_DEG = ((3.0, 13.0), (2.0, 16.0), (22.0, 18.0), (0.0, 15.0))
# What the fingers share beside that: by how much all MCP and all PIP joints bend together, deg, and
# all PIP joints alone.
_SHARED_DEG = ((25.0, 27.0), (0.0, 13.0))
# Width of a limit: those of the tables are nobody's own. At 3 deg sizes came out 2 to 3 % too
# large, at 1 deg .4 to 1 % (tuning half).
_LIMIT_RAD = np.deg2rad(2.0)
# A joint that may not move at all still gives a little (the middle finger's abduction).
_FIXED_SD_RAD = np.deg2rad(1.0)
# Angles that have one spread: each of the thumb's, and each joint of all fingers.
_GROUPS = (*((k,) for k in range(4)), *(tuple(range(4 + k, 20, 4)) for k in range(4)))
# How many frames the usual spreads count for against those of the recording: at 20 the spreads of
# calm scenes stayed twice what they were, and bones 30 % more wrong than at 5 or 2.
_SPREAD_FRAMES = 2.0


ANGLES = 20


class Posture(NamedTuple):
    """A Gaussian over the 20 own angles (rad, (5, 4) flattened), and limits of the angles."""

    mean: Array  # (20,)
    mean_sd: Array  # (20,) of the recording's own mean about that of all hands
    own_sd: Array  # (20,)
    shared: Array  # (20, 2) what the fingers share, a column a unit of each
    information: Array  # (20, 20)
    low: Array  # (20,)
    high: Array  # (20,)


def posture_of(model: HandModel) -> Posture:
    """The prior of a hand of which only the tables' limits are known."""
    moments = np.deg2rad(np.array([_THUMB_DEG, *(_FINGER_DEG,) * 4]))  # (5, 4, 2)
    low, high = np.moveaxis(model.limits_rad, 2, 0)
    sd = np.where(high > low, moments[:, :, 1], _FIXED_SD_RAD).ravel()
    shared = np.zeros((20, 2))
    shared[5::4], shared[6::4] = np.deg2rad(_SHARED_DEG).T
    mean = np.clip(moments[:, :, 0], low, high).ravel()
    return Posture(mean, sd, sd, shared, _information(sd, shared), low.ravel(), high.ravel())


def respread(usual: Posture, now: Posture, off: Array, covariances: Array) -> Posture:
    """With the spreads that a recording shows.

    off (n, 20): angles less their mean; covariances (n, 20, 20) of what was found. MacKay's
    fixed point (Neural Computation 4, 1992): a spread is judged by what the data determined of it.
    """
    n = len(off)
    C = np.diag(now.own_sd**2) + now.shared @ now.shared.T
    total = covariances.sum(axis=0)
    to_own, to_shared = now.own_sd[:, None] ** 2 * now.information, now.shared.T @ now.information
    own = off @ to_own.T
    left = n * (np.diag(now.own_sd**2) - to_own @ C @ to_own.T) + to_own @ total @ to_own.T
    sd = now.own_sd.copy()
    for group in _GROUPS:
        rows = list(group)
        count = n * len(rows) - float((np.diag(left)[rows] / now.own_sd[rows] ** 2).sum())
        moved = float((own[:, rows] ** 2 / usual.own_sd[rows] ** 2).sum())
        factor = (moved + _SPREAD_FRAMES) / (max(count, 0.0) + _SPREAD_FRAMES)
        sd[rows] = usual.own_sd[rows] * np.sqrt(factor)
    together = off @ to_shared.T
    left = n * (np.eye(2) - to_shared @ C @ to_shared.T) + to_shared @ total @ to_shared.T
    shared = now.shared.copy()
    for k in range(2):
        scale = float(np.linalg.norm(now.shared[:, k]) / np.linalg.norm(usual.shared[:, k]))
        count = n - float(left[k, k])
        moved = float((together[:, k] ** 2).sum()) * scale**2
        factor = (moved + _SPREAD_FRAMES) / (max(count, 0.0) + _SPREAD_FRAMES)
        shared[:, k] = usual.shared[:, k] * np.sqrt(factor)
    return now._replace(own_sd=sd, shared=shared, information=_information(sd, shared))


def _information(sd: Array, shared: Array) -> Array:
    return np.asarray(np.linalg.inv(np.diag(sd**2) + shared @ shared.T), dtype=np.float64)


class Penalty(NamedTuple):
    """Of each frame's own angles (n, 20): cost, gradient (half the cost's), Gauss-Newton matrix."""

    cost: Array  # (n,)
    gradient: Array  # (n, 20)
    H: Array  # (n, 20, 20)


def posture_penalty(posture: Posture, own: Array, coupling: Array) -> Penalty:
    """How far own angles (n, 20) are from what is usual, in squared standard deviations.

    coupling (20, 20): all angles from the own ones.
    """
    off, angles = own - posture.mean, own @ coupling.T
    pull = off @ posture.information
    # -2 log of a logistic function at either limit: smooth, and linear far beyond.
    below, above = (
        _expit(distance / _LIMIT_RAD) for distance in (posture.low - angles, angles - posture.high)
    )
    curvature = (below * (1.0 - below) + above * (1.0 - above)) / _LIMIT_RAD**2
    H = posture.information + (coupling.T * curvature[:, None]) @ coupling
    cost = np.einsum("na,na->n", off, pull)
    cost -= 2.0 * (np.log1p(-below) + np.log1p(-above)).sum(axis=1)
    return Penalty(cost, pull + (above - below) / _LIMIT_RAD @ coupling, H)


def _expit(x: Array) -> Array:
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(x, -30.0, 30.0))))
