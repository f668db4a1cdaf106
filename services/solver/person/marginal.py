"""The most plausible person when every pose is integrated out (Laplace's approximation), and how sure that is.

Wrist and tips alone fit a long finger, bent, as well as a short one, straight. Maximising over poses and person together then
prefers long bones: a bent finger can explain noise. Integrating the poses out, as statistics demands of nuisances (Neyman & Scott
1948; Tierney & Kadane 1986), weighs each person by the volume of poses that would do: 1/2 log det of the poses' information is
added to the cost. On simulated recordings this turns a bias of +10 % in the bones into none.
A problem whose numbers are absurd ends after a fixed number of rounds with a large cost; callers look at it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from rhot.transforms import Array
from services.solver.person.marks import UNKNOWNS, contracted
from services.solver.person.problem import Equations, Poses, Problem, coupling_information, equations

# Rounds of Newton's method for the poses: 3 to 5 near the solution, 30 from a bad start.
_ROUNDS = 60
# Of the quasi-Newton method for the person: 30 to 60 on simulated recordings.
_STEPS = 150
# Shift of the person in standard deviations for the second derivative by differences of the first.
_DIFFERENCE = 0.02


@dataclass(frozen=True)
class Fit:
    """The person found: unknowns x, their covariance, poses, how well the points are met, and each take's covariance of angles."""

    x: Array
    covariance: Array
    poses: Poses
    objective: float
    evaluations: int


class Marginal:
    """The function of the person alone; keeps the latest poses, from which the next ones start."""

    def __init__(self, problem: Problem, poses: Poses) -> None:
        self.problem, self.poses = problem, poses
        self.evaluations = 0

    def __call__(self, x: Array) -> tuple[float, Array]:
        """-log posterior density of the person but for a constant, and its gradient."""
        self.evaluations += 1
        self.poses, found, factors = best_poses(self.problem, x, self.poses)
        log_det, by_pose, by_x = _volume(self.problem, found, factors)
        gradient = found.g + by_x
        for take, factor, own in zip(found.takes, factors, by_pose, strict=True):
            gradient = gradient - take.X.T @ scipy.linalg.cho_solve(factor, own, check_finite=False)
        return 0.5 * (found.cost + log_det), gradient

    def information(self, x: Array) -> Array:
        """Second derivative by central differences of the gradient; (unknowns, unknowns)."""
        rows = []
        for step in _DIFFERENCE * np.eye(len(x)):
            rows.append((self(x + step)[1] - self(x - step)[1]) / (2.0 * _DIFFERENCE))
        H = np.array(rows)
        return 0.5 * (H + H.T)


def best_poses(problem: Problem, x: Array, poses: Poses) -> tuple[Poses, Equations, list]:
    """The most plausible poses of a person, from poses nearby; with the equations there and the factors of their matrices."""
    found = equations(problem, x, poses)
    damping = 0.0
    for _ in range(_ROUNDS):
        step, slope = np.empty((len(problem.points), UNKNOWNS)), 0.0
        for take, own in zip(problem.takes, found.takes, strict=True):
            damped = own.H + damping * np.diag(np.diag(own.H))
            move = -scipy.linalg.cho_solve(scipy.linalg.cho_factor(damped, lower=True, check_finite=False), own.g, check_finite=False)
            step[take.rows] = move.reshape(-1, UNKNOWNS)
            slope -= float(own.g @ move)
        # Half the predicted gain, in nats: far below anything that matters, and small enough for the gradient to be exact.
        if slope < 1e-7:
            break
        tried = poses.moved(step)
        new = equations(problem, x, tried)
        if new.cost <= found.cost:
            poses, found, damping = tried, new, 0.0 if damping < 1e-6 else 0.1 * damping
        else:
            damping = max(8.0 * damping, 1e-4)
            if damping > 1e8:
                break
    factors = [scipy.linalg.cho_factor(own.H, lower=True, check_finite=False) for own in found.takes]
    return poses, found, factors


def fit(problem: Problem, poses: Poses, x: Array) -> Fit:
    """From a first guess of poses and person."""
    function = Marginal(problem, poses)
    # In units in which the cost alone is a sphere the method needs few steps.
    scale = _spread(problem, x, function)
    done = scipy.optimize.minimize(
        lambda y: _scaled(function, x, scale, y), np.zeros(len(x)), jac=True, method="L-BFGS-B", options={"maxiter": _STEPS, "ftol": 1e-9, "gtol": 1e-3}
    )
    x = x + scale @ done.x
    information = function.information(x)
    values, vectors = np.linalg.eigh(information)
    # The prior is part of the information, so nothing is known worse than before but by what the approximation gets wrong.
    covariance = (vectors / np.maximum(values, 1.0)) @ vectors.T
    objective, _ = function(x)
    return Fit(x, covariance, function.poses, objective, function.evaluations)


def _scaled(function: Marginal, x: Array, scale: Array, y: Array) -> tuple[float, Array]:
    value, gradient = function(x + scale @ y)
    return value, scale.T @ gradient


def _spread(problem: Problem, x: Array, function: Marginal) -> Array:
    """A square root of the person's covariance by the cost alone."""
    function.poses, found, factors = best_poses(problem, x, function.poses)
    A = found.H.copy()
    for take, factor in zip(found.takes, factors, strict=True):
        A -= take.X.T @ scipy.linalg.cho_solve(factor, take.X, check_finite=False)
    values, vectors = np.linalg.eigh(0.5 * (A + A.T))
    return vectors / np.sqrt(np.maximum(values, 1.0))


def _volume(problem: Problem, found: Equations, factors: list) -> tuple[float, list[Array], Array]:
    """log det of the poses' information, half its derivative by each take's poses and by the person's unknowns."""
    log_det, covariances = 0.0, []
    for factor, own in zip(factors, found.takes, strict=True):
        log_det += 2.0 * float(np.log(np.diag(factor[0])).sum())
        covariances.append(scipy.linalg.cho_solve(factor, np.eye(len(own.g)), check_finite=False))
    n = len(problem.points)
    C = np.empty((n, UNKNOWNS, UNKNOWNS))
    by_ratio = np.zeros(5)
    for take, covariance in zip(problem.takes, covariances, strict=True):
        full = covariance.reshape(take.count, UNKNOWNS, take.count, UNKNOWNS)
        C[take.rows] = full[np.arange(take.count), :, np.arange(take.count), :]
        information = coupling_information(take.count)
        for row, ratio in enumerate(found.measures.ratios.tolist()):
            second, last = 6 + 4 * row + 2, 6 + 4 * row + 3
            by_ratio[row] += float(((ratio * full[:, second, :, second] - full[:, last, :, second]) * information).sum())
    marks = found.marks
    JC = marks.J @ C[:, None]
    by_pose, by_measure = contracted(problem.shape, marks, found.weights @ JC)
    by_measure[-5:] += by_ratio
    # Turning the wrist turns the rig's axes, and with them which direction is seen well.
    SW = JC @ np.swapaxes(marks.J, 2, 3) @ found.weights
    uneven = (SW - np.swapaxes(SW, 2, 3)).sum(axis=1)
    by_pose[:, :3] += np.stack([uneven[:, 1, 2], uneven[:, 2, 0], uneven[:, 0, 1]], axis=1)
    slope, bend = found.edges
    by_pose[:, 6:] += np.einsum("naa->na", C[:, 6:, 6:]) * slope * bend
    return log_det, [by_pose[take.rows].ravel() for take in problem.takes], found.measures.G.T @ by_measure
