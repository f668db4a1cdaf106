"""The hand that explains a recording of free motion, and how well it is known. Pure, deterministic.

What is looked for is the most plausible hand, its coupling and its mean posture, with the postures
of all frames integrated out (marginal.py); in turn with how much this person's joints move
(posture.respread). Gauss and Newton's steps on the hand, damped and no longer than two standard
deviations of what people differ by. 72 frames take 3 to 5 s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HandModel
from services.calibrator.hand.free_motion.frames import Seen
from services.calibrator.hand.free_motion.marginal import (
    ALIKE,
    ALIKE_TOLD,
    HandEquations,
    Plausibility,
    hand_equations,
    plausibility,
)
from services.calibrator.hand.free_motion.poses import Frames, Hand, HandPoses, first_poses
from services.calibrator.hand.free_motion.posture import ANGLES, Posture, posture_of, respread
from services.calibrator.hand.hand_parameters import (
    BASE_ROWS,
    SIZE,
    HandParameters,
    triple,
)
from services.calibrator.hand.landmark_jacobian import FIRST_ANGLE
from services.calibrator.hand.priors import SIZE_SD

# How often hand and spreads take turns, and steps of each turn at most.
_TURNS, _STEPS, _SPREAD_STEPS = 4, 30, 8
# Gauss-Newton steps of the poses: to begin with, after a step of the hand, after other spreads.
_FIRST_ROUNDS, _ROUNDS, _SPREAD_ROUNDS, _START_ROUNDS = 20, 10, 4, 4
_DAMPING_START, _DAMPING_DOWN, _DAMPING_UP = 0.1, 0.2, 8.0
_DAMPING_MIN, _DAMPING_MAX = 1e-6, 1e2
# Longest step, in standard deviations of people: linearisations reach no further.
_MAX_STEP = 2.0
# Half a squared standard deviation of one of a hundred unknowns is worth no further step.
_MIN_GAIN = 0.5


class Estimate(NamedTuple):
    """The most plausible hand."""

    parameters: HandParameters
    x: Array  # (p,) in standard deviations of people
    covariance: Array  # (p, p)
    poses: HandPoses
    residual_m: float  # RMS of a coordinate

    @property
    def model(self) -> HandModel:
        """As a model."""
        return self.parameters.model(self.x)

    @property
    def size(self) -> float:
        """Against the average adult's."""
        return float(np.exp(SIZE_SD * self.x[SIZE]))

    def knuckle_sigmas_m(self) -> Array:
        """How well the places of the four knuckles in the wrist frame are known; (4,)."""
        G = self.parameters.geometry(self.x).G
        rows = [G[triple(BASE_ROWS, row)] for row in range(1, 5)]
        return np.array([np.sqrt(np.trace(row @ self.covariance @ row.T)) for row in rows])


class _Climb(NamedTuple):
    """The best unknowns (hand, then mean posture) for some spreads."""

    x: Array  # (p + 20,)
    at: Plausibility
    equations: HandEquations


def estimate_hand(
    seen: Seen, table: HandModel, lengths_m: Mapping[tuple[int, int], float] | None = None
) -> Estimate:
    """The hand that explains the frames; table is an average one of size 1.

    lengths_m holds what was measured by hand: (digit, bone) -> metres.
    """
    parameters = HandParameters(table, seen.names, lengths_m)
    usual = now = posture_of(table)
    p, frames = parameters.unknowns, seen.frames
    x = np.zeros(p + ANGLES)
    x[SIZE] = np.log(seen.scale) / SIZE_SD
    poses, _ = first_poses(_hand(parameters, now, x), frames, _START_ROUNDS)
    found = _climb(parameters, now, frames, x, poses)
    for _ in range(_TURNS - 1):
        at = found.at
        for _ in range(_SPREAD_STEPS):
            off = at.poses.angles - now.mean - now.mean_sd * found.x[p:]
            inverse = np.asarray(np.linalg.inv(at.linear.H), dtype=np.float64)
            covariances = inverse[:, FIRST_ANGLE:, FIRST_ANGLE:]
            now = respread(usual, now, off, covariances)
            hand = _hand(parameters, now, found.x)
            at = plausibility(hand, found.x, frames, at.poses, _SPREAD_ROUNDS)
        found = _climb(parameters, now, frames, found.x, at.poses)
    # The information, with the tables' part of it as for frames that count for less.
    told = found.equations.A + (ALIKE_TOLD - ALIKE) * np.eye(len(found.x))
    covariance = ALIKE_TOLD * np.asarray(np.linalg.inv(told), dtype=np.float64)[:p, :p]
    seen_coordinates = 3 * int((frames.weights[:, :, 0, 0] > 0.0).sum())
    missing = frames.weights[:, :, :1, 0] == 0.0
    error = np.where(missing, 0.0, found.at.linear.error)
    residual_m = float(np.sqrt((error**2).sum() / seen_coordinates))
    return Estimate(parameters, found.x[:p], covariance, found.at.poses, residual_m)


def _hand(parameters: HandParameters, posture: Posture, x: Array) -> Hand:
    p = parameters.unknowns
    mean = posture.mean + posture.mean_sd * x[p:]
    return Hand(parameters, parameters.geometry(x[:p]), posture._replace(mean=mean))


def _climb(
    parameters: HandParameters, posture: Posture, frames: Frames, x: Array, poses: HandPoses
) -> _Climb:
    """The most plausible unknowns for given spreads, from x and poses."""
    hand = _hand(parameters, posture, x)
    at = plausibility(hand, x, frames, poses, _FIRST_ROUNDS)
    equations, damping = hand_equations(hand, x, frames, at), _DAMPING_START
    for _ in range(_STEPS):
        A = equations.A
        dx = -np.linalg.solve(A + damping * np.diag(np.diag(A)), equations.b)
        dx *= min(1.0, _MAX_STEP / max(float(np.linalg.norm(dx)), 1e-12))
        hand = _hand(parameters, posture, x + dx)
        moved = at.poses.moved(np.einsum("nap,p->na", equations.follow, dx))
        trial = plausibility(hand, x + dx, frames, moved, _ROUNDS)
        gain = at.cost - trial.cost
        if gain > 0.0:
            x, at = x + dx, trial
            equations = hand_equations(hand, x, frames, at)
            damping = max(damping * _DAMPING_DOWN, _DAMPING_MIN)
            if gain < _MIN_GAIN:
                break
        else:
            damping *= _DAMPING_UP
            if damping > _DAMPING_MAX:
                break
    return _Climb(x, at, equations)
