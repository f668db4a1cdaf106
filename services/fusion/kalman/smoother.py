"""A landmark's place at any instant from all observations of its track, before and after it.

Fixed-interval smoothing by the modified Bryson-Frazier recursion (Bierman, "Fixed interval
smoothing with discrete measurements", Int. J. Control 18(1), 1973): the same estimate as
Rauch-Tung-Striebel without inverting a covariance. It carries back what later observations say as
an adjoint vector (9,) and an information matrix (9, 9). The latter as a factor, two rows for each
later observation: there are few, so that is less than the matrix. Nobody asks for velocities, so of
the prediction only the rows of the position are made. Compiled; nothing here raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.kalman.measurement import adjoint_update
from services.fusion.kalman.motion_model import (
    Gaussian,
    Step,
    adjoint_predict,
    discretize,
    discretize_next,
    empty_step,
    transition,
)
from services.fusion.kalman.track_history import (
    NODES,
    TrackHistory,
    filtered,
    innovation_of,
    newest_node,
    nodes_until,
)

# A model that is less likely than this is left out: a third of them on a closing hand. Places of
# three recordings of it (4644 points, in one a fifth of frames lost) change by 1.4 um at most,
# sigmas by .5 %; the errors of held-out points (benchmarks/held_out.py) by nothing that is printed.
_UNLIKELY = 1e-6


class Place(NamedTuple):
    """Where a landmark is; arrays are written in place."""

    mean: Array  # (3,) m, rig frame
    cov: Array  # (3, 3)


class _Workspace(NamedTuple):
    """What smoothing fills on its way, made once for all landmarks and M models."""

    means: Array  # (M, 3) each model's
    covs: Array  # (M, 3, 3)
    step: Step
    path: Ints  # (NODES,) which model's estimate led to the newest, by node
    transitions: Array  # (NODES, M, 3, 3) each model's F from the node before (or the instant)
    rows: Array  # (3, 9) of the predicted covariance: the position's
    back: Array  # (1 + 2 NODES, 9) the adjoint, then the information's factor


@njit(cache=True, error_model="numpy")
def _workspace(models: int) -> _Workspace:
    return _Workspace(
        np.empty((models, 3)),
        np.empty((models, 3, 3)),
        empty_step(),
        np.empty(NODES, dtype=np.int64),
        np.empty((NODES, models, 3, 3)),
        np.empty((3, 9)),
        np.empty((1 + 2 * NODES, 9)),
    )


@njit(cache=True, error_model="numpy")
def smooth_landmark(
    history: TrackHistory, landmark: int, time_s: float, models: Array, work: _Workspace, out: Place
) -> bool:
    """The place of a landmark at an instant; written in place.

    models (M, 4): as motion_model.discretize has them; between two observations it is the step that
    was taken. False if its track does not reach back that far, or there is none.
    """
    index = nodes_until(history, landmark, time_s)
    if index == 0:
        return False
    last = history.order[landmark, index - 1]
    probability = history.probability[landmark, newest_node(history, landmark)]  # (M,)
    dt_s = time_s - history.time_s[landmark, last]
    later = index < history.size[landmark]
    if later:
        _transitions(history, landmark, index, models, time_s, work.transitions)
    stepped = -1
    for m in range(models.shape[0]):
        if probability[m] < _UNLIKELY:
            continue
        before = _follow(history, landmark, index, m, work.path)
        taken = work.path[index] if later else m
        if taken == stepped + 1:
            discretize_next(dt_s, models, taken, work.step)
        elif taken != stepped:
            discretize(dt_s, models[taken], work.step)
        stepped = taken
        place = Place(work.means[m], work.covs[m])
        _predict_rows(filtered(history, landmark, last, before), work.step, place.mean, work.rows)
        if models[taken, 3] > 0.0:
            ratio = models[taken, 3] / models[taken, 0]
            _add_noise_along(history.way[landmark, last], work.step, ratio, work.rows)
        place.cov[:] = work.rows[:, :3]
        if later:
            count = _carry_back(history, landmark, index, work)
            _apply_adjoint(work, count, place)
    _mix(probability, work.means, work.covs, out)
    return True


@njit(cache=True, error_model="numpy")
def smooth_all(
    history: TrackHistory, time_s: float, models: Array, means: Array, covs: Array
) -> Bools:
    """Which landmarks have a place at an instant (L,); to means (L, 3) and covs (L, 3, 3)."""
    found = np.zeros(history.size.shape[0], dtype=np.bool_)
    work = _workspace(models.shape[0])
    for landmark in range(history.size.shape[0]):
        if history.size[landmark] > 0:
            out = Place(means[landmark], covs[landmark])
            found[landmark] = smooth_landmark(history, landmark, time_s, models, work, out)
    return found


@njit(cache=True, error_model="numpy")
def smooth_one(
    history: TrackHistory, landmark: int, time_s: float, models: Array, out: Place
) -> bool:
    """As smooth_landmark, of one alone."""
    return smooth_landmark(history, landmark, time_s, models, _workspace(models.shape[0]), out)


@njit(cache=True, error_model="numpy")
def _mix(probability: Array, means: Array, covs: Array, out: Place) -> None:
    """Mean (3,) and covariance (3, 3) of a mixture of M Gaussians (M, 3), (M, 3, 3), without those
    that are unlikely.
    """
    mean, cov = out.mean, out.cov
    mean[:] = 0.0
    cov[:] = 0.0
    total = 0.0
    for m in range(means.shape[0]):
        if probability[m] >= _UNLIKELY:
            total += probability[m]
            for i in range(3):
                mean[i] += probability[m] * means[m, i]
    mean /= total
    for m in range(means.shape[0]):
        if probability[m] >= _UNLIKELY:
            weight = probability[m] / total
            for i in range(3):
                for j in range(3):
                    spread = (means[m, i] - mean[i]) * (means[m, j] - mean[j])
                    cov[i, j] += weight * (covs[m, i, j] + spread)


@njit(cache=True, error_model="numpy")
def _follow(history: TrackHistory, landmark: int, index: int, m: int, path: Ints) -> int:
    """Which models' estimates led to model m's newest, at the nodes from `index` on; to path.

    Returns that of the node before.
    """
    for k in range(history.size[landmark] - 1, index - 1, -1):
        path[k] = m
        m = history.parent[landmark, history.order[landmark, k], m]
    return m


@njit(cache=True, error_model="numpy")
def _transitions(
    history: TrackHistory, landmark: int, index: int, models: Array, time_s: float, out: Array
) -> None:
    """Each model's transition (3, 3) from time_s to node `index`, and from each to the next; to
    out (NODES, M, 3, 3). Models whose rates are alike have one.
    """
    before_s = time_s
    for k in range(index, history.size[landmark]):
        now_s = history.time_s[landmark, history.order[landmark, k]]
        for m in range(models.shape[0]):
            rates = models[m, 1], models[m, 2]
            if m > 0 and rates[0] == models[m - 1, 1] and rates[1] == models[m - 1, 2]:
                out[k, m] = out[k, m - 1]
            else:
                transition(now_s - before_s, rates[0], rates[1], out[k, m])
        before_s = now_s


@njit(cache=True, error_model="numpy")
def _predict_rows(last: Gaussian, step: Step, mean: Array, rows: Array) -> None:
    """motion_model.predict of the position: mean (3,), rows (3, 9) of the covariance; in place."""
    F, Q, P = step.F, step.Q, last.cov
    pv, pa, vv, va, av, aa = F[0, 1], F[0, 2], F[1, 1], F[1, 2], F[2, 1], F[2, 2]
    for i in range(3):
        mean[i] = last.mean[i] + pv * last.mean[i + 3] + pa * last.mean[i + 6]
        for j in range(9):  # F P
            rows[i, j] = P[i, j] + pv * P[i + 3, j] + pa * P[i + 6, j]
        for j in range(3):  # (F P) F^T
            p, v, a = rows[i, j], rows[i, j + 3], rows[i, j + 6]
            rows[i, j] = p + pv * v + pa * a
            rows[i, j + 3] = vv * v + va * a
            rows[i, j + 6] = av * v + aa * a
        for k in range(3):
            rows[i, 3 * k + i] += Q[0, k]


@njit(cache=True, error_model="numpy")
def _add_noise_along(way: Array, step: Step, ratio: float, rows: Array) -> None:
    """recent_way.add_noise_along to the rows (3, 9) of the position; in place."""
    scale = ratio / (way[0, 0] + way[1, 1] + way[2, 2])
    for j in range(3):
        noise = scale * step.Q[0, j]
        for k in range(3):
            for n in range(3):
                rows[k, 3 * j + n] += noise * way[k, n]


@njit(cache=True, error_model="numpy")
def _carry_back(history: TrackHistory, landmark: int, index: int, work: _Workspace) -> int:
    """What the nodes from `index` on, of work.path, say of the instant before them: to work.back.

    Returns how many of its rows that takes.
    """
    work.back[0] = 0.0
    count = 1
    for k in range(history.size[landmark] - 1, index - 1, -1):
        innovation = innovation_of(history, landmark, history.order[landmark, k], work.path[k])
        count = adjoint_update(work.back, count, innovation)
        adjoint_predict(work.back, count, work.transitions[k, work.path[k]])
    return count


@njit(cache=True, error_model="numpy")
def _apply_adjoint(work: _Workspace, count: int, place: Place) -> None:
    """x -= P adjoint, P -= (P G) (P G)^T of the information G G^T; in place, of the position."""
    P, back, cov = work.rows, work.back, place.cov
    for n in range(count):
        x, y, z = 0.0, 0.0, 0.0
        for k in range(9):
            x += P[0, k] * back[n, k]
            y += P[1, k] * back[n, k]
            z += P[2, k] * back[n, k]
        if n == 0:
            place.mean[0] -= x
            place.mean[1] -= y
            place.mean[2] -= z
        else:
            cov[0, 0] -= x * x
            cov[0, 1] -= x * y
            cov[0, 2] -= x * z
            cov[1, 1] -= y * y
            cov[1, 2] -= y * z
            cov[2, 2] -= z * z
    cov[1, 0], cov[2, 0], cov[2, 1] = cov[0, 1], cov[0, 2], cov[1, 2]
