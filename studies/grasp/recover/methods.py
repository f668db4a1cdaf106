"""The methods that a study compares, each for one frame: from the tip to the three flexions. Pure.

`closed-form`, `closed-form-own` and `fabrik` use the tip's position and the dependency of DIP on
PIP; `dls` and `dls-2` position and direction; `dls-1` the pose that the measured angles give
(the study's test of its own scheme). `dls-position` is ours without a direction; `dls` leans on
the dependency as far as the tip's noise and the doubt in the lengths ask for it, and not at all
without. The solver's lengths are metres: a recording's mm or px times 1e-3, which makes the study's
damping, whose lengths are mm or px, the printed one (dls_paper.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.solver.finger import analytic, dls, dls_paper, fabrik
from services.solver.finger.dls_equations import COUPLED, POSE, Goal, tip_goal
from services.solver.finger.outcome import SOLVED
from services.solver.finger.swing_limits import BOX
from services.solver.maths.chains import Chain
from services.solver.maths.kinematics import tip_position, tip_rotation
from studies.grasp.planar import TWO_THIRDS, canonical
from studies.grasp.recover.closed_form import solve_with_law
from studies.grasp.recover.laws import Law

# Share of the finger's length at which a tip counts as reached where its noise is not known or
# smaller: 0.4 mm of 80. Chosen with what phalanges seem to stretch (1 to 3 % in a fist) in mind:
# tighter, the solvers restart on every frame of a real finger and end in the same posture.
_REACHED_SHARE = 0.005
# A tip is reached within so many standard deviations of its measurement.
_REACHED_SIGMAS = 3.0
_MAX_ITERATIONS = 100
# How near DIP is to 2/3 PIP in people (rad, and rad per rad of PIP), for `dls` where tip and
# lengths are not known well: near a straight finger a pose says little of PIP and DIP (0.1 mm are
# 4 deg). Chosen on two rendered, filmed and measured people (tilt 10 deg, lengths that vary by 0.5
# mm): 4.6 and 2.9 deg RMS become 3.3 and 2.1. Judged on five synthetic people: noise of 0.3 mm, 2.1
# deg become 1.7; bones that look 3 % shorter across, 1.60 become 1.63; without noise nothing
# changes. Tighter (4 deg, 0.15) is better for who follows 2/3, and worse for who does not.
_LAW_RAD, _LAW_SHARE = np.deg2rad(6.0), 0.25
# Of a frame with that law: it converges linearly, and 5 leave less than 0.1 deg.
_LAW_ITERATIONS = 5
# Of a first frame in all, which is solved without the law before; at least two are with it.
_FIRST_ITERATIONS = 10
# The paper's scheme crawls at a straight finger: up to 100 iterations (dls_paper.py).
_MAX_PAPER_ITERATIONS = 200


class Finger(NamedTuple):
    """One frame's finger, in units of 1e-3 of the recording's."""

    chain: Chain
    lengths: Array  # (3,)
    law: Law | None  # the person's own
    doubt: float = 0.0  # sigma of its length in this plane, as a share of it


class Target(NamedTuple):
    """What one frame measured; NaN where it did not."""

    point: Array  # (2,) of the plane
    direction: float
    angles: Array  # (3,) measured, for dls-1 alone
    sigma: float
    first: bool = False  # of its sequence: the start says nothing


class Step(NamedTuple):
    """One frame's end."""

    angles: Array  # (3,)
    iterations: int
    left: float  # distance from the tip to the target
    outcome: int  # SOLVED | UNREACHABLE | NOT_CONVERGED


class Method(NamedTuple):
    """How one method solves a frame, from angles (3,), and what it needs to be measured."""

    solve: Callable[[Finger, Target, Array], Step]
    needs: str  # "position", "direction", "angles" or "law"
    about: str


def tolerance(finger: Finger, target: Target) -> float:
    """How near is there."""
    noise = _REACHED_SIGMAS * _doubt(finger, target)
    return float(max(_REACHED_SHARE, noise) * finger.lengths.sum())


def _doubt(finger: Finger, target: Target) -> float:
    """One standard deviation of the tip against the finger's lengths, as a share of them."""
    own = 0.0 if np.isnan(target.sigma) else target.sigma / float(finger.lengths.sum())
    return float(np.hypot(own, finger.doubt))


def _closed_form(finger: Finger, target: Target, start: Array) -> Step:
    q = np.append(0.0, start)
    done = analytic.solve(finger.chain, canonical(target.point), q, tolerance(finger, target))
    return Step(q[1:], *done)


def _closed_form_own(finger: Finger, target: Target, start: Array) -> Step:
    if finger.law is None:
        raise ValueError("closed-form-own needs a law")
    return Step(
        *solve_with_law(
            finger.lengths,
            finger.chain.limits,
            finger.law,
            target.point,
            start,
            tolerance(finger, target),
        )
    )


def _fabrik(finger: Finger, target: Target, start: Array) -> Step:
    q = np.append(0.0, start)
    near = tolerance(finger, target)
    done = fabrik.solve(finger.chain, canonical(target.point), q, BOX, _MAX_ITERATIONS, near)
    return Step(q[1:], *done)


def _dls(finger: Finger, target: Target, start: Array) -> Step:
    rotation = tip_rotation(np.array([0.0, target.direction, 0.0, 0.0]))
    doubt, used = _doubt(finger, target), 0
    if target.first or doubt == 0.0:
        step = _own(finger, target, start, POSE, rotation)
        if doubt == 0.0:
            return step
        start, used = step.angles, step.iterations
    q = np.append(0.0, start)
    prior = np.zeros((2, 4))
    prior[0, 3] = TWO_THIRDS * start[1]
    prior[1, 3] = doubt / np.hypot(_LAW_RAD, _LAW_SHARE * start[1])
    goal = Goal(POSE, canonical(target.point), rotation, prior)
    near = tolerance(finger, target)
    most = min(_LAW_ITERATIONS, max(_FIRST_ITERATIONS - used, 2))
    steps, left, outcome = dls.solve_digit(finger.chain, goal, q, most, near)
    if outcome != SOLVED:
        more, left, outcome = dls.solve_digit(finger.chain, goal, q, _MAX_ITERATIONS, near)
        steps += more
    return Step(q[1:], used + steps, left, outcome)


def _dls_position(finger: Finger, target: Target, start: Array) -> Step:
    return _own(finger, target, start, COUPLED, None)


def _own(finger: Finger, target: Target, start: Array, kind: int, rotation: Array | None) -> Step:
    q = np.append(0.0, start)
    goal = tip_goal(kind, canonical(target.point), rotation)
    near = tolerance(finger, target)
    return Step(q[1:], *dls.solve_digit(finger.chain, goal, q, _MAX_ITERATIONS, near))


def _dls_1(finger: Finger, target: Target, start: Array) -> Step:
    q = np.append(0.0, target.angles)
    return _paper(finger, tip_position(finger.chain, q), tip_rotation(q), target, start)


def _dls_2(finger: Finger, target: Target, start: Array) -> Step:
    rotation = tip_rotation(np.array([0.0, target.direction, 0.0, 0.0]))
    return _paper(finger, canonical(target.point), rotation, target, start)


def _paper(finger: Finger, point: Array, rotation: Array, target: Target, start: Array) -> Step:
    options = dls_paper.Options(
        max_iterations=_MAX_PAPER_ITERATIONS, tolerance_m=tolerance(finger, target)
    )
    done = dls_paper.solve(finger.chain, point, rotation, np.append(0.0, start), options)
    return Step(done.angles_rad[1:], done.iterations, done.residual_m, done.outcome)


# By their names in commands, files and figures.
METHODS: dict[str, Method] = {
    "closed-form": Method(_closed_form, "position", "tip position, DIP = 2/3 PIP"),
    "closed-form-own": Method(_closed_form_own, "law", "tip position, the person's own DIP law"),
    "dls-1": Method(_dls_1, "angles", "the paper's DLS, goal: kinematics of measured angles"),
    "dls-2": Method(_dls_2, "direction", "the paper's DLS, goal: measured tip pose"),
    "dls": Method(_dls, "direction", "rhot's DLS, goal: measured tip pose, DIP as noise asks"),
    "dls-position": Method(_dls_position, "position", "rhot's DLS, tip position, DIP near 2/3 PIP"),
    "fabrik": Method(_fabrik, "position", "FABRIK, tip position, DIP = 2/3 PIP"),
}
