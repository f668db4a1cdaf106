"""How sure a pose is of which the hand's model is not: consider states.

The fit takes bones and paint for known. They are not: bones of people of one size differ by a
tenth, a dab sits some millimetres beside where it should. Such an error is constant, so it does not
average out over frames, and the fit's own covariance P, which knows noise and habit, says nothing
of it. Here the constant errors b are consider states (Schmidt 1966; Jazwinski 1970, section 8.4):
they are not estimated, but their effect S = d(pose error)/d(b) is carried along with every update,

    S = S_before - P H' R^-1 (H S_before + J),

H and J the derivatives of the landmarks by pose and by b, R the landmarks' covariance. S B S' is
what they add to the pose's covariance, B the covariance of b. Limits of joints are not considered.
R is the fit's own, with the misfit that it learned: with a smaller one P H' R^-1 H exceeds what P
allows, and S grows without end where it should die away. Huber's weights and a rival's share of P
do the same for some messages, so the gain is held to that bound (`_consistent_share`).
Two cures go with that: landmarks are told to the fit no more precisely than the model is
(`landmark_m2`), and a hand that was measured has small errors, one that is known exactly none.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import TIPS, HandModel
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import CHAINS, HandChains
from services.solver.maths.kinematics import digit_frames
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.hand_tracker import MAX_GAP_S
from services.solver.whole_hand.landmarks import MAX_LISTS, Landmarks, Observations
from services.solver.whole_hand.motion_prior import UNKNOWNS

# First columns of b: the hand's size (1), its bones (15), the roots of its chains (15), then the
# paint of every landmark (3 each).
_SIZE, _BONES, _ROOTS, _PAINT = 0, 1, 16, 31
# Time in which what an old error did to the angles is forgotten, between the motion prior's two.
_FORGET_S = 0.4
# Eigenvalues this much above 1 are rounding: covariances of 26 unknowns are inverted to about 1e-9.
_ROUNDING = 1e-6
# Share of the fit's own covariance that is published: its prior allows for more postures than a
# hand takes. On fourteen rendered captures of hands that were known exactly, squared errors over
# variances were .47 (wrist), .28 (orientation), .33 (fingers) with all of it.
_FIT_SHARE = 0.5


class Spread(NamedTuple):
    """Standard deviations of what a model says."""

    size: float  # of the whole hand, a share
    bone: float  # of each bone, a share
    root_m: float  # of each chain's root along each axis
    tip_paint_m: tuple[float, float, float]  # of a tip's paint in its joint's frame
    dab_m: tuple[float, float, float]  # of a dab
    landmark_m: float  # of a landmark along each axis, as the fit is told


# Bones within a tenth, paint dipped 8 to 20 mm deep, dabs within 5 mm, all evenly. Fourteen
# rendered captures of such hands: with landmarks at 0, 2, 4 and 8 mm fingers were off by 14.0,
# 11.1, 10.3 and 9.4 deg RMS, orientation by 8.5, 7.7, 7.3 and 7.0; beyond, hands of the tables'
# proportions lose more than others gain.
_TABLES = Spread(0.05, 0.06, 3e-3, (5e-4, 5e-4, 2e-3), (3e-3, 1e-3, 3e-3), 5e-3)
# What `rhot calibrate hand` leaves: knuckles within 3 mm, and paint that is put on anew.
_MEASURED = Spread(0.0, 0.02, 1e-3, (5e-4, 5e-4, 1e-3), (1e-3, 5e-4, 1e-3), 1e-3)
_EXACT = Spread(0.0, 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)


class ModelError:
    """The errors of one hand's model, and what they have done to its pose."""

    def __init__(self, model: HandModel, chains: HandChains, landmarks: Landmarks) -> None:
        """landmarks: all of the model (landmarks.hand_landmarks)."""
        spread = {"tables": _TABLES, "measured": _MEASURED}.get(model.origin, _EXACT)
        paint = [spread.tip_paint_m if name in TIPS else spread.dab_m for name in landmarks]
        self._chains = chains
        # Added to each landmark's variance along each axis: it is known no better than the model
        # knows where it sits.
        self.landmark_m2 = spread.landmark_m**2
        self._column = {name: _PAINT + 3 * n for n, name in enumerate(landmarks)}
        # The first columns of landmarks' paint, by their names.
        self._columns: dict[tuple[str, ...], Integers] = {}
        self._sigmas = np.concatenate(
            [[spread.size], [spread.bone] * 15, [spread.root_m] * 15, np.ravel(paint)]
        )
        self._known_wrong = bool(self._sigmas.any())
        self._S = np.zeros((UNKNOWNS, len(self._sigmas)))
        self._stamp_ns = 0

    def pose_variances(
        self,
        stamp_ns: int,
        estimate: HandEstimate,
        names: tuple[str, ...],
        observations: Observations,
    ) -> Array:
        """The variances (26,) of an estimate's rotation, position and angles (rad^2, m^2).

        names and observations: the landmarks that it was fitted to, as the fit was told.
        """
        if not self._known_wrong:
            return _FIT_SHARE * estimate.covariance.diagonal()
        seconds = (stamp_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = stamp_ns
        is_gap = not 0.0 <= seconds <= MAX_GAP_S
        columns = self._columns.get(names)
        if columns is None:
            columns = np.array([self._column[name] for name in names], dtype=np.int64)
            # Names come from the network, in any order: the memory for them is bounded.
            if len(self._columns) < MAX_LISTS:
                self._columns[names] = columns
        return _considered(
            self._chains,
            observations,
            columns,
            (estimate.rotation, estimate.angles_rad, estimate.covariance),
            (self._S, self._sigmas),
            0.0 if is_gap else math.exp(-seconds / _FORGET_S),
        )


@njit(cache=True)
def _considered(
    chains: HandChains,
    observations: Observations,
    paint_columns: Integers,
    estimate: tuple[Array, Array, Array],
    errors: tuple[Array, Array],
    keep: float,
) -> Array:
    """The variances (26,) of a pose with what the model's errors add to them.

    estimate: rotation (3, 3), angles (5, 4) and covariance (26, 26) of the fit. errors: S (26, b),
    taken on to this message, and their standard deviations (b,). keep: how much of an old error's
    effect on the angles is left, 0: of its effect on anything.
    """
    rotation, angles, covariance = estimate
    S, sigmas = errors
    if keep == 0.0:
        S[:] = 0.0
    S[6:] *= keep
    H = np.zeros((3 * observations.joint.size, UNKNOWNS))
    J = np.zeros((3 * observations.joint.size, sigmas.size))
    _fill_derivatives(chains, observations, paint_columns, rotation, angles, (H, J))
    for n in range(observations.joint.size):
        _whiten(observations.whitening[n], H[3 * n : 3 * n + 3])
        _whiten(observations.whitening[n], J[3 * n : 3 * n + 3])
    gain = covariance @ H.T
    gain *= _consistent_share(H @ gain)
    S -= gain @ (H @ S + J)
    variances = np.empty(UNKNOWNS)
    for i in range(UNKNOWNS):
        variances[i] = _FIT_SHARE * covariance[i, i]
        for k in range(sigmas.size):
            variances[i] += (S[i, k] * sigmas[k]) ** 2
    return variances


@njit(cache=True)
def _turn(R: Array, v: Array, out: Array) -> None:
    """Fill out (3,) with R v: for three numbers a call of `@` costs more than the product."""
    for i in range(3):
        out[i] = R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2]


@njit(cache=True)
def _whiten(W: Array, rows: Array) -> None:
    """Multiply rows (3, n) by a lower triangle W (3, 3), in place."""
    for k in range(rows.shape[1]):
        rows[2, k] = W[2, 0] * rows[0, k] + W[2, 1] * rows[1, k] + W[2, 2] * rows[2, k]
        rows[1, k] = W[1, 0] * rows[0, k] + W[1, 1] * rows[1, k]
        rows[0, k] = W[0, 0] * rows[0, k]


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
                return 1.0 / max(np.linalg.eigvalsh(0.5 * (B + B.T))[-1], 1.0)
    return 1.0


@njit(cache=True)
def _fill_derivatives(
    chains: HandChains,
    observations: Observations,
    paint_columns: Integers,
    R: Array,
    angles: Array,
    out: tuple[Array, Array],
) -> None:
    """Fill out = (H (3 m, 26), J (3 m, b)) with derivatives of m landmarks, which are 0.

    H by rotation, position and angles, J by the model's errors; R (3, 3) and angles (5, 4): the
    pose.
    """
    H, J = out
    frames = digit_frames(chains, angles)
    p, arm, moved = np.empty(3), np.empty(3), np.empty(3)
    for n in range(observations.joint.size):
        row = observations.digit[n]
        h, j = H[3 * n : 3 * n + 3], J[3 * n : 3 * n + 3]
        paint = j[:, paint_columns[n] : paint_columns[n] + 3]
        if row < 0:
            p[:] = observations.offset_m[n]
            paint[:] = R
        else:
            k = 0
            while CHAINS[row, k] != observations.joint[n]:
                k += 1
            _turn(frames.rotations[row, k], observations.offset_m[n], p)
            p += frames.roots_m[row, k]
            for i in range(3):
                _turn(R, frames.rotations[row, k, :, i], paint[:, i])
            j[:, _ROOTS + 3 * row : _ROOTS + 3 * row + 3] = R
            for bone in range(k):
                along = frames.roots_m[row, bone + 1] - frames.roots_m[row, bone]
                _turn(R, along, j[:, _BONES + 3 * row + bone])
            for a in range(observations.depth[n]):
                # Axis x lever arm. Abduction and the first flexion turn about the same root.
                lever = p - frames.roots_m[row, max(a - 1, 0)]
                x, y, z = frames.axes[row, a]
                moved[0] = y * lever[2] - z * lever[1]
                moved[1] = z * lever[0] - x * lever[2]
                moved[2] = x * lever[1] - y * lever[0]
                _turn(R, moved, h[:, 6 + 4 * row + a])
        _turn(R, p, arm)
        j[:, _SIZE] = arm
        h[0, 1], h[0, 2] = arm[2], -arm[1]
        h[1, 0], h[1, 2] = -arm[2], arm[0]
        h[2, 0], h[2, 1] = arm[1], -arm[0]
        for i in range(3):
            h[i, 3 + i] = 1.0
