"""What errors of a hand's model do to its pose, carried along from message to message.

The kernels of model_error.py, which says what is computed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import unowned
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import CHAINS, HandChains
from services.solver.maths.kinematics import FUSED, DigitFrames, digit_frames
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.motion_prior import UNKNOWNS
from services.solver.whole_hand.residuals import Pose, whitened

# First columns of b: the hand's size (1), its bones (15), the roots of its chains (15), then the
# paint of every landmark that was seen (3 each).
_SIZE, _BONES, _ROOTS, PAINT = 0, 1, 16, 31
# Eigenvalues this much above 1 are rounding: covariances of 26 unknowns are inverted to about 1e-9.
_ROUNDING = 1e-6
# How far landmarks miss is forgotten so much more slowly than what errors did to angles: in 2 s.
_SLOWER = 5.0
# Bounds of what that may do to variances. A hand at rest fits whatever its bones are; a message
# that fits nothing (a hand that jumps) counts no more than a bad model.
_LEAST, _MOST = 0.25, 9.0
# Share of the fit's own covariance that is published: its prior allows for more postures than a
# hand takes. On fourteen rendered captures of hands that were known exactly, squared errors over
# variances were .47 (wrist), .28 (orientation), .33 (fingers) with all of it.
_FIT_SHARE = 0.5


class Errors(NamedTuple):
    """The errors of a model as a kernel takes them on to a message."""

    effect: Array  # (26, b) S, changed in place
    sigmas: Array  # (b,) standard deviations; all 0: the model is exact
    paint_columns: Integers  # (m,) first columns of the paint of a message's landmarks
    misfit: Array  # (1,) squared residuals of landmarks over what is usual, changed in place
    # What is usual, per degree of freedom (0: not known); and what of a landmark's variance, as the
    # fit is told, is the model's.
    landmark_m2: tuple[float, float]
    # How much of an old error's effect on the angles is left; 0: of its effect on anything.
    keep: float


@njit(cache=True, fastmath=FUSED)
def variances(
    chains: HandChains, observations: Observations, estimate: HandEstimate, errors: Errors
) -> Array:
    """`ModelError.pose_variances`, for kernels; carries the effect of the errors along."""
    chains, observations = unowned((chains, observations))
    estimate, errors = unowned((estimate, errors))
    found = np.empty(UNKNOWNS)
    is_unsure = errors.sigmas.any()
    if is_unsure:
        _carry_along(chains, observations, estimate, errors)
    # A size that is wrong leaves no residual: what it does is as unsure as ever.
    share = max(errors.misfit[0], _LEAST)
    effect, sigmas, covariance = errors.effect, errors.sigmas, estimate.covariance
    for i in range(UNKNOWNS):
        found[i] = _FIT_SHARE * share * covariance[i, i]
        if is_unsure:
            for k in range(sigmas.size):
                by_error = (effect[i, k] * sigmas[k]) ** 2
                found[i] += by_error if k == _SIZE else share * by_error
    return found


@njit(cache=True)
def told_misfit(errors: Errors) -> float:
    """Squared residuals of the landmarks over what is usual of such models; -1: not known."""
    return errors.misfit[0] if errors.landmark_m2[0] > 0.0 else -1.0


@njit(cache=True, fastmath=FUSED)
def _carry_along(
    chains: HandChains, observations: Observations, estimate: HandEstimate, errors: Errors
) -> None:
    """Take S on to a message, of which estimate is the fit."""
    S, m = errors.effect, observations.joint.size
    if errors.keep == 0.0:
        S[:] = 0.0
        errors.misfit[0] = 1.0
    for i in range(6, UNKNOWNS):
        for k in range(S.shape[1]):
            S[i, k] *= errors.keep
    # Derivatives by pose and by b, in standard deviations.
    H, J, residuals = np.zeros((3 * m, UNKNOWNS)), np.zeros((3 * m, S.shape[1])), np.empty(3 * m)
    pose = Pose(estimate.rotation, estimate.position_m, estimate.angles_rad)
    frames = digit_frames(chains, pose.angles)
    columns = errors.paint_columns
    _linearise(frames, observations, pose, columns, (H, J, residuals), np.empty((3, 10)))
    gain = estimate.covariance @ H.T
    B = H @ gain
    _learn_misfit(observations.whitening, B, residuals, errors)
    gain *= _consistent_share(B)
    S -= gain @ (H @ S + J)


@njit(cache=True, fastmath=FUSED)
def _linearise(
    frames: DigitFrames,
    observations: Observations,
    pose: Pose,
    columns: Integers,
    out: tuple[Array, Array, Array],
    of_one: Array,
) -> None:
    """To out the landmarks' derivatives by pose (3 m, 26), which are 0, and by the errors (3 m, b),
    and their residuals (3 m,).

    columns (m,): the first of each landmark's paint; of_one (3, 10): memory.
    """
    (H, J, residuals), of_one = unowned((out, of_one))
    frames, observations = unowned((frames, observations))
    pose, columns = unowned((pose, columns))
    for n in range(columns.size):
        error = whitened(frames, observations, n, pose, of_one)
        for a in range(6 + observations.depth[n]):
            i = a if a < 6 else 4 * observations.digit[n] + a
            for r in range(3):
                H[3 * n + r, i] = of_one[r, a]
        for i in range(3):
            residuals[3 * n + i] = error[i]
            # The hand's size moves a landmark along its own way from the wrist.
            J[3 * n + i, _SIZE] = error[i]
            for k in range(i + 1):
                way = observations.point_m[n, k] - pose.position_m[k]
                J[3 * n + i, _SIZE] += observations.whitening[n, i, k] * way
        _by_errors(frames, observations, n, pose.rotation, columns[n], J)


@njit(cache=True)
def _learn_misfit(whitening: Array, B: Array, residuals: Array, errors: Errors) -> None:
    """Take errors.misfit on to a fit's residuals (3 m,), in standard deviations.

    whitening (m, 3, 3) of its landmarks. Of B = H P H' (3 m, 3 m) what the fit is free to follow
    leaves no residual; what is noise of the landmarks leaves all of it, so what is known badly
    counts little.
    """
    usual_m2, model_m2 = errors.landmark_m2
    if usual_m2 == 0.0:
        return
    found, usual = 0.0, 0.0
    for i in range(residuals.size):
        information = 0.0
        for k in range(3):
            information += whitening[i // 3, i % 3, k] ** 2
        by_model = min(model_m2 * information, 1.0)
        freedom = max(1.0 - B[i, i], 0.0)
        found += by_model**2 * residuals[i] ** 2
        usual += by_model**2 * freedom * (usual_m2 * information + 1.0 - by_model)
    if usual > 0.0:
        old = errors.keep ** (1.0 / _SLOWER)
        errors.misfit[0] = old * errors.misfit[0] + (1.0 - old) * min(found / usual, _MOST)


@njit(cache=True, inline="always")
def _by_errors(
    frames: DigitFrames, observations: Observations, n: int, R: Array, column: int, J: Array
) -> None:
    """Fill three rows of J (3 m, b), which are 0, with a landmark's derivatives by the errors,
    but for the hand's size.

    In standard deviations; R (3, 3): the wrist's axes; column: the first of the landmark's paint.
    """
    W, row, k = observations.whitening, observations.digit[n], 0
    while row >= 0 and CHAINS[row, k] != observations.joint[n]:
        k += 1
    for i in range(3):
        # The wrist's axes along one of the directions in which the landmark's errors are apart.
        r, x, y, z = 3 * n + i, 0.0, 0.0, 0.0
        for j in range(i + 1):
            x += W[n, i, j] * R[j, 0]
            y += W[n, i, j] * R[j, 1]
            z += W[n, i, j] * R[j, 2]
        if row < 0:
            J[r, column], J[r, column + 1], J[r, column + 2] = x, y, z
        else:
            root = _ROOTS + 3 * row
            J[r, root], J[r, root + 1], J[r, root + 2] = x, y, z
            for j in range(3):
                J[r, column + j] = (
                    x * frames.rotations[row, k, 0, j]
                    + y * frames.rotations[row, k, 1, j]
                    + z * frames.rotations[row, k, 2, j]
                )
            for b in range(k):
                u = frames.roots_m[row, b + 1, 0] - frames.roots_m[row, b, 0]
                v = frames.roots_m[row, b + 1, 1] - frames.roots_m[row, b, 1]
                w = frames.roots_m[row, b + 1, 2] - frames.roots_m[row, b, 2]
                J[r, _BONES + 3 * row + b] = x * u + y * v + z * w


@njit(cache=True)
def _consistent_share(B: Array) -> float:
    """How much of a gain is left where B = H P H' (n, n), whitened, is to be at most 1.

    P is what is left of a prior after the landmarks: no more than they alone would leave. 1 where
    that holds, which a Cholesky factorisation tells; else 1 / the largest eigenvalue.
    """
    n = B.shape[0]
    L = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            value = (1.0 + _ROUNDING if i == j else 0.0) - B[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = value / L[j, j]
            elif value > 0.0:
                L[i, i] = math.sqrt(value)
            else:
                return 1.0 / max(np.linalg.eigvalsh(B)[-1], 1.0)
    return 1.0
