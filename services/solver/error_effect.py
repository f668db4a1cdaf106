"""What errors of a hand's model do to its pose, carried along from message to message.

The kernels of model_error.py, which says what is computed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Layout, unowned
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import CHAINS, HandChains
from services.solver.maths.cholesky import factorise
from services.solver.maths.kinematics import FUSED, DigitFrames, digit_frames
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS
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


class Effect(NamedTuple):
    """What the errors of a model have done to a pose."""

    S: Array  # (26, b) its derivatives by them, changed in place
    sigmas: Array  # (b,) standard deviations; all 0: the model is exact
    misfit: Array  # (1,) squared residuals of landmarks over what is usual, changed in place
    paint_columns: Integers  # (m,) first columns of the paint of a message's landmarks


EFFECT = Layout()
effect_at = EFFECT.at


class Errors(NamedTuple):
    """The errors of a model as a kernel takes them on to a message."""

    effect: Effect
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
    S, sigmas = errors.effect.S, errors.effect.sigmas
    is_unsure = sigmas.any()
    if is_unsure:
        _carry_along(chains, observations, estimate, errors)
    # A size that is wrong leaves no residual: what it does is as unsure as ever.
    share = max(errors.effect.misfit[0], _LEAST)
    covariance = estimate.covariance
    for i in range(UNKNOWNS):
        found[i] = _FIT_SHARE * share * covariance[i, i]
        if is_unsure:
            for k in range(sigmas.size):
                by_error = (S[i, k] * sigmas[k]) ** 2
                found[i] += by_error if k == _SIZE else share * by_error
    return found


@njit(cache=True)
def told_misfit(errors: Errors) -> float:
    """Squared residuals of the landmarks over what is usual of such models; -1: not known."""
    return errors.effect.misfit[0] if errors.landmark_m2[0] > 0.0 else -1.0


@njit(cache=True, fastmath=FUSED)
def _carry_along(
    chains: HandChains, observations: Observations, estimate: HandEstimate, errors: Errors
) -> None:
    """Take S on to a message, of which estimate is the fit."""
    S, m = errors.effect.S, observations.joint.size
    if errors.keep == 0.0:
        S[:] = 0.0
        errors.effect.misfit[0] = 1.0
    for i in range(6, UNKNOWNS):
        for k in range(S.shape[1]):
            S[i, k] *= errors.keep
    # Derivatives by pose and by b, in standard deviations.
    H, J, residuals = np.zeros((3 * m, UNKNOWNS)), np.zeros((3 * m, S.shape[1])), np.empty(3 * m)
    pose = Pose(estimate.rotation, estimate.position_m, estimate.angles_rad)
    frames = digit_frames(chains, pose.angles)
    columns = errors.effect.paint_columns
    _linearise(frames, observations, pose, columns, (H, J, residuals), np.empty((3, 10)))
    gain, B = np.zeros((3 * m, UNKNOWNS)), np.empty((3 * m, 3 * m))
    _gains(observations, H, estimate.covariance, gain, B)
    _learn_misfit(observations.whitening, B, residuals, errors)
    _correct(observations, H, gain, _consistent_share(B), J, S)


@njit(cache=True, inline="always")
def _unknown_of(observations: Observations, n: int, a: int) -> int:
    """The unknown that moves landmark n as the a-th of those that do."""
    return a if a < 6 else 4 * observations.digit[n] + a


# Products are written out, by rows: each landmark depends on ten unknowns of 26, and the code of a
# library that multiplies matrices is never in the processor's caches when a message comes.
@njit(cache=True, fastmath=FUSED)
def _add_product(observations: Observations, H: Array, M: Array, out: Array) -> None:
    """Add H M to out (3 m, k); H (3 m, 26), M (26, k)."""
    for n in range(observations.depth.size):
        for a in range(6 + observations.depth[n]):
            i, r = _unknown_of(observations, n, a), 3 * n
            x, y, z = H[r, i], H[r + 1, i], H[r + 2, i]
            for k in range(M.shape[1]):
                out[r, k] += x * M[i, k]
                out[r + 1, k] += y * M[i, k]
                out[r + 2, k] += z * M[i, k]


@njit(cache=True, fastmath=FUSED)
def _gains(observations: Observations, H: Array, P: Array, gain: Array, B: Array) -> None:
    """H P to gain (3 m, 26), which is 0, and H P H' to B (3 m, 3 m); H (3 m, 26), P (26, 26)."""
    observations, H, P = unowned((observations, H, P))
    gain, B = unowned((gain, B))
    _add_product(observations, H, P, gain)
    for r in range(H.shape[0]):
        for s in range(r + 1):
            total = 0.0
            for a in range(6 + observations.depth[r // 3]):
                i = _unknown_of(observations, r // 3, a)
                total += H[r, i] * gain[s, i]
            B[r, s] = B[s, r] = total


@njit(cache=True, fastmath=FUSED)
def _correct(
    observations: Observations, H: Array, gain: Array, share: float, J: Array, S: Array
) -> None:
    """S less a share of what the gain (3 m, 26) makes of H S + J, in place; J is written over."""
    observations, H, gain = unowned((observations, H, gain))
    J, S = unowned((J, S))
    _add_product(observations, H, S, J)
    for i in range(UNKNOWNS):
        # A landmark's three at once.
        for r in range(0, H.shape[0], 3):
            x, y, z = share * gain[r, i], share * gain[r + 1, i], share * gain[r + 2, i]
            for k in range(S.shape[1]):
                S[i, k] -= x * J[r, k] + y * J[r + 1, k] + z * J[r + 2, k]


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
            i = _unknown_of(observations, n, a)
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
    """Take the misfit on to a fit's residuals (3 m,), in standard deviations.

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
        misfit = errors.effect.misfit
        misfit[0] = old * misfit[0] + (1.0 - old) * min(found / usual, _MOST)


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
    L = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            L[i, j] = -B[i, j]
        L[i, i] += 1.0 + _ROUNDING
    if factorise(L, n, 0.0):
        return 1.0
    return float(1.0 / max(np.linalg.eigvalsh(B)[-1], 1.0))
