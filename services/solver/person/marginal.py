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
import scipy.optimize

from rhot.transforms import Array
from services.solver.person.elimination import Eliminated
from services.solver.person.marks import contracted
from services.solver.person.problem import HABIT_SD, Equations, Poses, Problem, equations

# Rounds of Newton's method for the poses: 3 to 5 near the solution.
_ROUNDS = 60
# Of Levenberg's for poses and person together, as a start: 20 to 30.
_START_ROUNDS = 60
# Of the quasi-Newton method for the person: 30 to 60 on simulated recordings.
_STEPS = 150
# Shift of the person in standard deviations for the second derivative by differences of the first.
_DIFFERENCE = 0.02


@dataclass(frozen=True)
class Fit:
    """The person found: unknowns x (p,), their covariance (p, p), poses; objective in nats, and how often it was evaluated."""

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
        self.poses, found = best_poses(self.problem, x, self.poses)
        eliminated = Eliminated(self.problem, found)
        frames, mixed, own = eliminated.covariances()
        free, F, free_log_det = _free(self.problem, found)
        by_pose, by_x = _volume(self.problem, found, frames - free, mixed)
        by_x = by_x + _habit_volume(self.problem, found, frames - free, mixed, own)
        person = self.problem.shape.unknowns
        by_ratio = np.zeros(len(x))
        for row in range(5):
            second, last = 8 + 4 * row, 9 + 4 * row
            # d/dr of 1/2 logdet(F'HF) = tr(P F'H dF), dF[last, second] = 1 where free
            on = self.problem.free[self.problem.take_of, 4 * row + 2]
            P_FH = np.einsum("na,nab->nb", F[1][:, second], np.swapaxes(F[0], 1, 2) @ found.H)
            by_ratio[person - 5 + row] = float((P_FH[:, last] * on).sum()) * found.measures.G[-5 + row, person - 5 + row]
        moved, _ = _newton(self.problem, found).by_person()
        gradient = found.person_g + by_x - by_ratio + np.einsum("na,nap->p", by_pose, moved)
        return 0.5 * (float(found.costs.sum()) + float(x @ x) + eliminated.log_det() - free_log_det), gradient

    def information(self, x: Array) -> Array:
        """Second derivative by differences of the gradient; (p, p)."""
        here = self(x)[1]
        H = np.array([(self(x + step)[1] - here) / _DIFFERENCE for step in _DIFFERENCE * np.eye(len(x))])
        return 0.5 * (H + H.T)


def fit(problem: Problem, poses: Poses, x: Array) -> Fit:
    """From a first guess of poses and person."""
    x, poses = start(problem, poses, x)
    function = Marginal(problem, poses)
    # In units in which the cost alone is a sphere the method needs few steps.
    scale = _spread(problem, x, function)

    def scaled(y: Array) -> tuple[float, Array]:
        value, gradient = function(x + scale @ y)
        return value, scale.T @ gradient

    done = scipy.optimize.minimize(
        scaled, np.zeros(len(x)), jac=True, method="L-BFGS-B", options={"maxiter": _STEPS, "ftol": 1e-9, "gtol": 1e-3}
    )
    x = x + scale @ done.x
    values, vectors = np.linalg.eigh(function.information(x))
    # The prior is part of the information, so nothing is known worse than before but by what the approximation gets wrong.
    covariance = (vectors / np.maximum(values, 1.0)) @ vectors.T
    objective, _ = function(x)
    return Fit(x, covariance, function.poses, objective, function.evaluations)


def start(problem: Problem, poses: Poses, x: Array) -> tuple[Array, Poses]:
    """Poses and person that fit best together: biased, but near."""
    damping, found = 1e-3, equations(problem, x, poses)
    cost = float(found.costs.sum() + x @ x)
    for _ in range(_START_ROUNDS):
        eliminated = Eliminated(problem, found, damping=np.full(len(problem.takes), damping))
        moved, offsets = eliminated.by_person()
        p = problem.shape.unknowns
        A = found.person_H + np.einsum("nap,naq->pq", found.X, moved) + np.einsum("tap,taq->pq", found.offsets_X, offsets)
        A[np.diag_indices_from(A)] += damping * np.diag(found.person_H)
        b = found.person_g + np.einsum("nap,na->p", moved, found.g) + np.einsum("tap,ta->p", offsets, found.offsets_g)
        dx = np.zeros(len(x))
        dx[:p] = -np.linalg.solve(A[:p, :p], b[:p])
        own, own_offsets = eliminated.solve(found.g, found.offsets_g)
        tried = poses.moved(moved @ dx - own, offsets @ dx - own_offsets)
        new = equations(problem, x + dx, tried)
        new_cost = float(new.costs.sum() + (x + dx) @ (x + dx))
        if new_cost < cost:
            done = cost - new_cost < 1e-3 * (1.0 + 1e-3 * cost)
            x, poses, found, cost, damping = x + dx, tried, new, new_cost, max(0.2 * damping, 1e-9)
            if done:
                break
        else:
            damping *= 6.0
            if damping > 1e8:
                break
    return x, poses


def best_poses(problem: Problem, x: Array, poses: Poses) -> tuple[Poses, Equations]:
    """The most plausible poses of a person, from poses nearby, and the equations there. Takes are improved independently."""
    found = equations(problem, x, poses)
    damping = np.zeros(len(problem.takes))
    for _ in range(_ROUNDS):
        eliminated = _newton(problem, found, damping)
        step, offsets = eliminated.solve(found.g, found.offsets_g)
        gains = problem.by_take((step * found.g).sum(axis=1)) + (offsets * found.offsets_g).sum(axis=1)
        # Far below a nat, and small enough for the gradient to be exact.
        if gains.max() < 1e-8:
            break
        tried = poses.moved(-step, -offsets)
        new = equations(problem, x, tried)
        better = new.costs <= found.costs + 1e-9
        if better.all():
            poses, found = tried, new
        elif better.any():
            frames = better[problem.take_of]
            mixed = [np.where(frames.reshape(-1, *(1,) * (a.ndim - 1)), b, a) for a, b in zip(poses[:3], tried[:3], strict=True)]
            poses = Poses(*mixed, np.where(better[:, None], tried.offsets, poses.offsets))
            found = equations(problem, x, poses)
        damping = np.where(better, np.where(damping < 1e-4, 0.0, 0.1 * damping), np.maximum(8.0 * damping, 1e-3))
        if damping.max() > 1e8:
            break
    return poses, found


def _newton(problem: Problem, found: Equations, damping: Array | None = None) -> Eliminated:
    """Newton's matrix where it is definite, else Gauss and Newton's."""
    try:
        return Eliminated(problem, found, damping=damping, bent=True)
    except np.linalg.LinAlgError:
        return Eliminated(problem, found, damping=damping)


def _spread(problem: Problem, x: Array, function: Marginal) -> Array:
    """A square root of the person's covariance by the cost alone."""
    function.poses, found = best_poses(problem, x, function.poses)
    moved, offsets = Eliminated(problem, found).by_person()
    A = found.person_H + np.einsum("nap,naq->pq", found.X, moved) + np.einsum("tap,taq->pq", found.offsets_X, offsets)
    p = problem.shape.unknowns
    A[p:] = 0.0
    A[:, p:] = 0.0
    A[np.arange(p, len(A)), np.arange(p, len(A))] = np.diag(found.person_H)[p:]
    values, vectors = np.linalg.eigh(0.5 * (A + A.T))
    return vectors / np.sqrt(np.maximum(values, 1.0))


def _free(problem, found):
    n = len(found.H)
    F = np.zeros((n, 26, 26))
    on = np.concatenate([np.ones((n, 6), bool), problem.free[problem.take_of]], axis=1)
    i = np.arange(26)
    F[:, i, i] = on
    for row, ratio in enumerate(found.measures.ratios.tolist()):
        second, last = 8 + 4 * row, 9 + 4 * row
        F[:, last, second] = np.where(on[:, second], ratio, 0.0)
    A = np.swapaxes(F, 1, 2) @ found.H @ F
    A[:, i, i] += ~on
    P = np.linalg.inv(A)
    P[:, i, i] -= ~on
    return F @ P @ np.swapaxes(F, 1, 2), (F, P), float(np.linalg.slogdet(A)[1].sum())


def _volume(problem: Problem, found: Equations, C: Array, mixed: Array) -> tuple[Array, Array]:
    """Half the derivative of log det by the frames' unknowns (n, 26) and by the person's (p,)."""
    marks = found.marks
    JC = marks.J @ C[:, None]
    by_pose, by_measure = contracted(problem.shape, marks, found.weights @ JC)
    for row, ratio in enumerate(found.measures.ratios.tolist()):
        second, last, offset = 8 + 4 * row, 9 + 4 * row, 20 + row
        information = found.informations[1][problem.take_of, offset]
        of_ratio = ratio * C[:, second, second] - C[:, last, second] + mixed[:, second, offset]
        by_measure[-5 + row] += float(of_ratio @ information)
    # Turning the wrist turns the rig's axes, and with them which direction is seen well.
    SW = (JC @ np.swapaxes(marks.J, 2, 3) @ found.weights).sum(axis=1)
    uneven = SW - np.swapaxes(SW, 1, 2)
    by_pose[:, :3] += np.stack([uneven[:, 1, 2], uneven[:, 2, 0], uneven[:, 0, 1]], axis=1)
    slope, bend = found.edges
    by_pose[:, 6:] += np.einsum("naa->na", C[:, 6:, 6:]) * slope * bend
    by_x = np.zeros(problem.unknowns)
    by_x[: problem.shape.unknowns] = found.measures.G.T @ by_measure
    return by_pose, by_x


def _habit_volume(problem, found, C, mixed, own):
    """Half the derivative of log det by the habits."""
    out = np.zeros(problem.unknowns)
    person = problem.shape.unknowns
    lasting, changing = found.informations
    ratios = found.measures.ratios
    frames = np.arange(len(C))
    for a in range(25):
        vl = -HABIT_SD * lasting[:, a] * own[:, a, a]
        ok = problem.lasting_habit[:, a] >= 0
        np.add.at(out, person + problem.lasting_habit[ok, a], vl[ok])
        if a < 20:
            var = C[:, 6 + a, 6 + a] - 2 * mixed[:, 6 + a, a] + own[problem.take_of, a, a]
        else:
            s, l, r = 8 + 4 * (a - 20), 9 + 4 * (a - 20), ratios[a - 20]
            var = C[:, l, l] - 2 * r * C[:, l, s] + r * r * C[:, s, s] - 2 * (mixed[:, l, a] - r * mixed[:, s, a]) + own[problem.take_of, a, a]
        vc = -HABIT_SD * changing[:, a] * problem.by_take(var)
        ok = problem.changing_habit[:, a] >= 0
        np.add.at(out, person + problem.changing_habit[ok, a], vc[ok])
    return out
