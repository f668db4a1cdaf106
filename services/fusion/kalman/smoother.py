"""A landmark's estimate at any instant from all observations of its track, before and after it.

Fixed-interval smoothing by the modified Bryson-Frazier recursion (Bierman, "Fixed interval
smoothing with discrete measurements", Int. J. Control 18(1), 1973): the same estimate as
Rauch-Tung-Striebel without inverting a covariance. It carries back what later observations say as
an adjoint vector (9,) and an information matrix (9, 9). Compiled; nothing here raises.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.kalman.measurement import Innovation
from services.fusion.kalman.motion_model import (
    Gaussian,
    adjoint_predict,
    discretize,
    empty_step,
    predict,
    transition,
)
from services.fusion.kalman.recent_way import add_noise_along
from services.fusion.kalman.track_history import (
    TrackHistory,
    filtered,
    innovation_of,
    newest_node,
    nodes_until,
)


@njit(cache=True)
def smooth_landmark(
    history: TrackHistory, landmark: int, time_s: float, models: Array, out: Gaussian
) -> bool:
    """Position and velocity (6,), (6, 6) of a landmark at an instant; written in place.

    models (M, 4): as motion_model.discretize has them; between two observations it is the step that
    was taken. False if its track does not reach back that far, or there is none.
    """
    index = nodes_until(history, landmark, time_s)
    if index == 0:
        return False
    last = history.order[landmark, index - 1]
    probability = history.probability[landmark, newest_node(history, landmark)]  # (M,)
    dt_s = time_s - history.time_s[landmark, last]
    step = empty_step()
    means = np.empty((models.shape[0], 9))
    covs = np.empty((models.shape[0], 9, 9))
    path = np.empty(history.size[landmark], dtype=np.int64)
    for m in range(models.shape[0]):
        before = _follow(history, landmark, index, m, path)
        state = Gaussian(means[m], covs[m])
        taken = path[index] if index < path.shape[0] else m
        discretize(dt_s, models[taken], step)
        predict(filtered(history, landmark, last, before), step, state)
        if models[taken, 3] > 0.0:
            ratio = models[taken, 3] / models[taken, 0]
            add_noise_along(history.way[landmark, last], step, ratio, state)
        if index < path.shape[0]:
            _smooth(history, landmark, index, path, models, time_s, state)
    _mix(probability, means, covs, out)
    return True


@njit(cache=True)
def smooth_all(
    history: TrackHistory, time_s: float, models: Array, means: Array, covs: Array
) -> Bools:
    """Which landmarks have an estimate at an instant (L,); to means (L, 6) and covs (L, 6, 6)."""
    found = np.zeros(history.size.shape[0], dtype=np.bool_)
    for landmark in range(history.size.shape[0]):
        if history.size[landmark] > 0:
            out = Gaussian(means[landmark], covs[landmark])
            found[landmark] = smooth_landmark(history, landmark, time_s, models, out)
    return found


@njit(cache=True)
def _mix(probability: Array, means: Array, covs: Array, out: Gaussian) -> None:
    """Mean (6,) and covariance (6, 6) of a mixture of M Gaussians (M, 9), (M, 9, 9)."""
    mean, cov = out.mean, out.cov
    mean[:] = 0.0
    cov[:] = 0.0
    for m in range(means.shape[0]):
        mean += probability[m] * means[m, :6]
    for m in range(means.shape[0]):
        for i in range(6):
            for j in range(6):
                spread = (means[m, i] - mean[i]) * (means[m, j] - mean[j])
                cov[i, j] += probability[m] * (covs[m, i, j] + spread)


@njit(cache=True)
def _follow(history: TrackHistory, landmark: int, index: int, m: int, path: Ints) -> int:
    """Which models' estimates led to model m's newest, at the nodes from `index` on; to path.

    Returns that of the node before.
    """
    for k in range(path.shape[0] - 1, index - 1, -1):
        path[k] = m
        m = history.parent[landmark, history.order[landmark, k], m]
    return m


@njit(cache=True)
def _smooth(
    history: TrackHistory,
    landmark: int,
    index: int,
    path: Ints,
    models: Array,
    time_s: float,
    state: Gaussian,
) -> None:
    """Smooth a prediction to time_s by the nodes from `index` on, all later, of path; in place."""
    adjoint = np.zeros(9)
    information = np.zeros((9, 9))
    F = np.empty((3, 3))
    for k in range(path.shape[0] - 1, index - 1, -1):
        node = history.order[landmark, k]
        before_s = time_s
        if k > index:
            before_s = history.time_s[landmark, history.order[landmark, k - 1]]
        adjoint_update(adjoint, information, innovation_of(history, landmark, node, path[k]))
        model = models[path[k]]
        transition(history.time_s[landmark, node] - before_s, model[1], model[2], F)
        adjoint_predict(adjoint, information, F)
    _apply_adjoint(adjoint, information, state)


@njit(cache=True)
def _apply_adjoint(adjoint: Array, information: Array, state: Gaussian) -> None:
    """x -= P adjoint, P -= P information P, kept symmetric; in place, of position and velocity.

    Nobody asks for the acceleration. A row of P at a time: its products are of neighbours in
    memory, which a processor takes several at a time of.
    """
    P = state.cov
    P_information = np.zeros((6, 9))
    reduction = np.zeros((6, 6))
    for i in range(6):
        for k in range(9):
            state.mean[i] -= P[i, k] * adjoint[k]
            for j in range(9):
                P_information[i, j] += P[i, k] * information[k, j]
        for k in range(9):
            for j in range(6):
                reduction[i, j] += P_information[i, k] * P[k, j]
    for i in range(6):
        for j in range(6):
            P[i, j] -= 0.5 * (reduction[i, j] + reduction[j, i])


@njit(cache=True)
def adjoint_update(adjoint: Array, information: Array, innovation: Innovation) -> None:
    """The step back over one measurement, in place: from after its update to before it.

    adjoint (9,): (I - K H)^T adjoint - H^T S^-1 nu.
    information (9, 9): (I - K H)^T information (I - K H) + H^T S^-1 H.
    """
    H, nu, S_inverse, K = innovation.H, innovation.nu, innovation.S_inverse, innovation.K
    information_K = np.empty((9, 2))
    for i in range(9):
        for k in range(2):
            total = 0.0
            for j in range(9):
                total += information[i, j] * K[j, k]
            information_K[i, k] = total
    w = np.empty(2)  # S^-1 nu + K^T adjoint
    W = np.empty((2, 2))  # S^-1 + K^T information K
    for k in range(2):
        w[k] = S_inverse[k, 0] * nu[0] + S_inverse[k, 1] * nu[1]
        for j in range(9):
            w[k] += K[j, k] * adjoint[j]
        for n in range(2):
            W[k, n] = S_inverse[k, n]
            for j in range(9):
                W[k, n] += K[j, k] * information_K[j, n]
    for i in range(3):
        adjoint[i] -= H[0, i] * w[0] + H[1, i] * w[1]
        for j in range(9):
            cross = information_K[j, 0] * H[0, i] + information_K[j, 1] * H[1, i]
            information[i, j] -= cross
            information[j, i] -= cross
        for j in range(3):
            information[i, j] += H[0, i] * (W[0, 0] * H[0, j] + W[0, 1] * H[1, j]) + H[1, i] * (
                W[1, 0] * H[0, j] + W[1, 1] * H[1, j]
            )
