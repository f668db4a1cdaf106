"""A hand's pose from one message to the next: predict, fit, and how sure that is.

One compiled call: the arrays that a call from Python is given cost as much as some iterations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Layout, Packed
from services.solver.maths.chains import HandChains
from services.solver.maths.cholesky import spd_inverse
from services.solver.whole_hand.fit import MAX_ITERATIONS, fit
from services.solver.whole_hand.glide import is_quiet
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.landmarks import (
    Observations,
    Observed,
    observations_of,
    places_at,
    whitening,
)
from services.solver.whole_hand.model_misfit import learned_misfit
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS, PosePrior, predict
from services.solver.whole_hand.priors.posture_prior import PosturePrior
from services.solver.whole_hand.residuals import Pose


class Known(NamedTuple):
    """What is known of a hand before anything is seen of it."""

    chains: HandChains
    posture: PosturePrior


KNOWN = Layout()
known_at = KNOWN.at


class Followed(NamedTuple):
    """What a message made of a hand that nothing rivals."""

    estimate: HandEstimate
    whitening: Array  # (m, 3, 3) of the landmarks, as in Observations
    misfit_m2: float  # as learned from it
    quiet: bool  # whether it may be told as it is (glide.py)


def follow(
    packed: Packed,
    places: Packed,
    observed: Observed,
    misfit_m2: float,
    last: HandEstimate,
    told: HandEstimate,
    seconds: float,
) -> Followed:
    """A message of landmarks that sit at places, some seconds after the last estimate.

    packed: Known; places: PLACES. last, told: what was believed and what was told.
    """
    # Arrays to be filled, and tuples unpacked: numba takes four times as long over an array in a
    # tuple, and three times over one that it returns.
    found = np.empty((3, 3)), np.empty(3), np.empty((5, 4)), np.empty((UNKNOWNS, UNKNOWNS))
    whitened = np.empty_like(observed.covariances_m2)
    cost, iterations, learned_m2, quiet = _follow_unpacked(
        *found,
        whitened,
        packed.address,
        places.address,
        observed.points_m,
        observed.covariances_m2,
        misfit_m2,
        last.rotation,
        last.position_m,
        last.angles_rad,
        last.covariance,
        told.rotation,
        told.angles_rad,
        seconds,
    )
    return Followed(HandEstimate(*found, cost, iterations), whitened, learned_m2, quiet)


@njit(cache=True)
def _follow_unpacked(
    found_rotation: Array,
    found_position_m: Array,
    found_angles: Array,
    found_covariance: Array,
    whitened: Array,
    address: int,
    places: int,
    points_m: Array,
    covariances_m2: Array,
    misfit_m2: float,
    rotation: Array,
    position_m: Array,
    angles: Array,
    covariance: Array,
    told_rotation: Array,
    told_angles: Array,
    seconds: float,
) -> tuple[float, int, float, bool]:
    """`follow` with plain arrays for its tuples, the first five for what it returns."""
    known: Known = known_at(address)
    whitened[:] = whitening(covariances_m2, misfit_m2)
    observations = observations_of(places_at(places), points_m, whitened)
    last = HandEstimate(rotation, position_m, angles, covariance, 0.0, 0)
    own = update(known.chains, known.posture, observations, last, seconds)
    found_rotation[:], found_position_m[:] = own.rotation, own.position_m
    found_angles[:], found_covariance[:] = own.angles_rad, own.covariance
    return (
        own.cost,
        own.iterations,
        learned_misfit(misfit_m2, whitened, own.cost, seconds),
        is_quiet(told_rotation, told_angles, own, seconds),
    )


@njit(cache=True)
def update(
    chains: HandChains,
    posture: PosturePrior,
    observations: Observations,
    last: HandEstimate,
    seconds: float,
) -> HandEstimate:
    """The hand some seconds after the last estimate of it: predicted, then fitted."""
    angles, information = predict(posture, last.angles_rad, last.covariance, seconds)
    prior = PosePrior(last.rotation, last.position_m, angles, information)
    pose = Pose(last.rotation.copy(), last.position_m.copy(), angles.copy())
    for a in range(20):
        limit = chains.limits_rad[a // 4, a % 4]
        pose.angles[a // 4, a % 4] = min(max(angles[a // 4, a % 4], limit[0]), limit[1])
    found = np.empty((UNKNOWNS, UNKNOWNS))
    cost, used = fit(chains, observations, prior, pose, MAX_ITERATIONS, found)
    return HandEstimate(pose.rotation, pose.position_m, pose.angles, spd_inverse(found), cost, used)
