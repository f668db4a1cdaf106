"""The prior on a hand's posture: couplings and habits as one Gaussian.

Constraints of three types, after Lin, Wu & Huang as RHOT section 3.1 quotes them. Type I
constraints (limits of each joint, the middle finger's abduction fixed) are hard: they come from
HandModel.limits_rad, and no output leaves them (services/solver/maths/joint_limits.py). Type II
(couplings) and type III (habits) are soft: each is a standard deviation in radians, so that
measurements weighed by theirs win where they say anything.

DIP follows PIP per person (HandModel: coupling, coupling_weight; weight 0 turns it off). Between
fingers the coupling is that they close together: what all MCP and all PIP joints share varies much,
each finger's own part less (the first synergy of Santello, Flanders & Soechting, J. Neurosci.
18(23), 1998). Wrist and tips leave open which way the palm is pitched; without this a closing fist
looks like four fingers in four unlikely postures, or like a hand that turns. A hand that was never
measured uses the tables of rhot/hand_tables.py.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HandModel

# Standard deviation of DIP about ratio * PIP at weight 1. Real hands: DIP/PIP .68-.74 in strong
# flexion, .08-.47 relaxed (finger study, Fig. 7; the recorded OpenXR poses), i.e. 5 to 15 deg off
# 2/3 at a PIP of 30 deg.
_COUPLING_SD_DEG = 5.0
# The thumb's IP joint about ratio * MCP: off by -4, 2 and 13 deg in the recorded OpenXR poses. At 5
# deg a thumb that bends on its own turns the whole hand (orientation error 3.8 deg, 3.4 at 15;
# simulated hands, 1 mm); one that follows loses nothing.
_THUMB_COUPLING_SD_DEG = 15.0
# Habitual posture (type III): mean of (abduction, flexions), of a relaxed hand, rounded, and each
# joint's own standard deviation. The recorded Leap fist, pinch and wave differ less between fingers
# (MCP 1 to 13, PIP 1 to 6 deg); a hand that points differs more.
_FINGER_REST_DEG = ((0.0, 7.0), (32.0, 20.0), (42.0, 22.0), (28.0, 24.0))
# Abduction of a hand with the tables' bones, whose own fingers and knuckles nobody knows: the Leap
# recordings' fingers lean towards the little one's side by 6 to 14 deg on average, those of the
# OpenXR poses by 0 to 9. benchmarks/unmeasured_posture.py, orientation and fingers of both, with
# (0, 7) 14.7, 22.6 and 6.4, 18.5 deg RMS, with (-2, 5) 14.4, 22.4 and 5.5, 17.8; a closing fist
# whose fingers do not lean turns by less than 8 deg still, but by 10 with (-4, 5). Less freedom
# also shows better which hands are not the tables' (HandPose.model_misfit): within three sigmas
# were 95 and 97 % of the tips of the other renderer's tuning clips. Measured hands lose by it.
_TABLES_ABDUCTION_DEG = (-2.0, 5.0)
_THUMB_REST_DEG = ((2.0, 13.0), (2.0, 16.0), (22.0, 18.0), (22.0, 24.0))
# What the fingers share, beside that: standard deviation of all MCP joints together and of all PIP
# joints (DIP in its ratio), and how the two go together. From open to fist, MCP 8 to 84 and PIP 12
# to 104 deg, is 3 deviations each. Shared deviations of 30 and 35 or own ones of 15 to 22 change
# the simulated scenes by less than 10 %; a correlation of .8 costs 10 % of flexion error, and a
# looser one lets a hand that is held still wander.
_SYNERGY_SD_DEG, _SYNERGY_CORRELATION = (25.0, 30.0), 0.9


class PosturePrior(NamedTuple):
    """A Gaussian over a hand's angles before anything is measured.

    Radians, angles in the order of (5, 4) flattened.
    """

    mean: Array  # (20,)
    information: Array  # (20, 20)
    covariance: Array  # (20, 20)
    # Directions in which the fingers close together, and how much of a posture lies along each (a
    # projection in the metric of information: projection @ synergies is the identity).
    synergies: Array  # (20, 2)
    projection: Array  # (2, 20)


def posture_prior(model: HandModel) -> PosturePrior:
    """All soft constraints of a person's hand as one Gaussian over its 20 angles.

    The coupling is one row a.q = b with a standard deviation s: information a a'/s^2
    (Gauss-Markov).
    """
    rest = np.deg2rad(np.array([_THUMB_REST_DEG, *(_FINGER_REST_DEG,) * 4]))  # (5, 4, 2)
    if model.origin == "tables":
        rest[1:, 0] = np.deg2rad(_TABLES_ABDUCTION_DEG)
    limits = model.limits_rad
    synergies = _synergies(model)
    own = np.diag((rest[:, :, 1] ** 2).ravel())
    shared = synergies @ _synergy_covariance() @ synergies.T
    information = np.asarray(np.linalg.inv(own + shared), dtype=np.float64)
    pull = information @ np.clip(rest[:, :, 0], limits[:, :, 0], limits[:, :, 1]).ravel()
    for row, digit in enumerate(model.digits):
        coupled = np.zeros(20)
        coupled[4 * row + 3], coupled[4 * row + 2] = 1.0, -digit.coupling
        sigma = np.deg2rad(_THUMB_COUPLING_SD_DEG if row == 0 else _COUPLING_SD_DEG)
        information += np.outer(coupled, coupled) * (digit.coupling_weight / sigma) ** 2
    covariance = np.linalg.inv(information)
    projection = np.asarray(
        np.linalg.solve(synergies.T @ information @ synergies, synergies.T @ information),
        dtype=np.float64,
    )
    return PosturePrior(
        covariance @ pull, information, 0.5 * (covariance + covariance.T), synergies, projection
    )


def _synergies(model: HandModel) -> Array:
    """All MCP joints of the fingers together, and all PIP with their DIP joints; (20, 2)."""
    synergies = np.zeros((20, 2))
    for row, digit in enumerate(model.digits[1:], start=1):
        synergies[4 * row + 1, 0] = 1.0
        synergies[4 * row + 2 : 4 * row + 4, 1] = 1.0, digit.coupling
    return synergies


def _synergy_covariance() -> Array:
    """Of how far the fingers close along the two synergies; (2, 2) rad^2."""
    sd = np.deg2rad(_SYNERGY_SD_DEG)
    correlation = np.array([[1.0, _SYNERGY_CORRELATION], [_SYNERGY_CORRELATION, 1.0]])
    return np.outer(sd, sd) * correlation
