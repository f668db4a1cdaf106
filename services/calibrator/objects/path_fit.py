"""A tracker's motion at any instant, by robust local cubics through the poses about it. Pure.

Local polynomials (Savitzky & Golay 1964, Cleveland 1979) for position and for the rotation vector
from the nearest pose; both give the velocity as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.geometry.transforms import Array
from services.calibrator.objects.sightings import Bools, Ints

# Poses within this of an instant take part, the far ones least. Of one rendered recording, with 1
# mm of noise that is white or lasts .5 s, lateness is off by .1 and .6 ms RMS with .066 s, by .2
# and 1.0 with .09.
_HALF_WINDOW_S = 0.066
# As many take part before an instant as after it: else the noise of its place and that of its
# velocity go together, and registration takes them for lateness. With thirteen poses 120 times a
# second stamps seemed .8 ms late by 1 mm of white noise and 4 by 3 mm. No fewer than a cubic needs,
# with some to spare, and no more than averages anything at 250 Hz and above.
_MIN_PAIRS, _MAX_PAIRS = 4, 14
# A cubic and one to spare.
_LEAST_POSES = 5
# Nothing is known inside a gap of more than this: a hand at 10 m/s^2 departs by 1 mm from a cubic.
_MAX_GAP_S = 0.06
# Rounds of reweighting; in the last the weights change by some percent.
_ROUNDS = 3
# Residuals beyond this many usual ones lose their weight (Cauchy, 95 % efficient without outliers).
_CAUCHY = 2.4
# A pose this many usual deviations from what its neighbours say has jumped; and at least so far:
# a sharp turn (20 m/s^2, 100 rad/s^2) departs by less between neighbours at 90 Hz.
_JUMP, _MIN_JUMP_M, _MIN_JUMP_RAD = 8.0, 0.015, 0.06


class Motion(NamedTuple):
    """Where a tracker is, and how it moves, in the lighthouses' frame at m instants.

    known is false where no poses enclose the instant; the rest is then zero, the rotation identity.
    """

    known: Bools  # (m,)
    position_m: Array  # (m, 3)
    rotation: Array  # (m, 3, 3), R_lighthouse_from_tracker
    velocity_m_s: Array  # (m, 3)
    angular_velocity_rad_s: Array  # (m, 3)

    @staticmethod
    def nowhere(m: int) -> Motion:
        """At m instants of which nothing is known."""
        zeros = np.zeros((m, 3))
        return Motion(np.zeros(m, dtype=bool), zeros, np.tile(np.eye(3), (m, 1, 1)), zeros, zeros)

    def only(self, wanted: Bools | Ints) -> Motion:
        """At some of the instants."""
        return Motion(
            self.known[wanted],
            self.position_m[wanted],
            self.rotation[wanted],
            self.velocity_m_s[wanted],
            self.angular_velocity_rad_s[wanted],
        )


def screen(times_s: Array, positions_m: Array, rotations: Array) -> Bools:
    """Which of n poses agree with their neighbours; (n,).

    Each is compared with the median of what sixteen pairs of neighbours, one before and one after,
    interpolate at its instant: three of the eight may be wrong.
    """
    n = len(times_s)
    if n < 9:
        return np.ones(n, dtype=bool)
    middle = np.clip(np.arange(n), 4, n - 5)
    before, after = middle[:, None] - np.arange(1, 5), middle[:, None] + np.arange(1, 5)
    quaternions = _aligned(Rotation.from_matrix(rotations).as_quat(), middle)
    values = np.concatenate([positions_m, quaternions], axis=1)  # (n, 7)
    t0, t1 = times_s[before][:, :, None], times_s[after][:, None, :]
    share = ((times_s[middle][:, None, None] - t0) / (t1 - t0))[..., None]
    first, second = values[before][:, :, None, :], values[after][:, None, :, :]
    # Neighbouring quaternions may have opposite signs.
    first = _like(first, values[middle][:, None, None, :])
    second = _like(second, values[middle][:, None, None, :])
    pairs = first + share * (second - first)  # (n, 4, 4, 7)
    miss = values[middle] - np.median(pairs.reshape(n, 16, 7), axis=1)
    jump_m = np.linalg.norm(miss[:, :3], axis=1)
    jump_rad = 2.0 * np.linalg.norm(miss[:, 3:], axis=1)
    limit_m = max(_JUMP * float(np.median(jump_m)), _MIN_JUMP_M)
    limit_rad = max(_JUMP * float(np.median(jump_rad)), _MIN_JUMP_RAD)
    good = (jump_m <= limit_m) & (jump_rad <= limit_rad)
    # The first and last four are as their nearest that has neighbours, which may be wrong itself:
    # they are given up.
    good[:4] = good[-4:] = False
    return np.asarray(good)


def _aligned(quaternions: Array, middle: Ints) -> Array:
    """Quaternions (n, 4) with signs continuous in time."""
    flips = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    return np.asarray(quaternions * signs[: len(middle), None])


def _like(values: Array, reference: Array) -> Array:
    """Values (..., 7) with the sign of each quaternion (last four) as the reference's."""
    sign = np.where(np.sum(values[..., 3:] * reference[..., 3:], axis=-1) < 0.0, -1.0, 1.0)
    return np.concatenate([values[..., :3], values[..., 3:] * sign[..., None]], axis=-1)


def fit_motion(times_s: Array, positions_m: Array, rotations: Array, at_s: Array) -> Motion:
    """The motion at instants (m,) from poses (n,) in order of time."""
    n, m = len(times_s), len(at_s)
    if n < 2 * _MIN_PAIRS or not m:
        return Motion.nowhere(m)
    step_s = float(np.median(np.diff(times_s)))
    pairs = int(np.clip(round(_HALF_WINDOW_S / step_s), _MIN_PAIRS, min(_MAX_PAIRS, n // 2)))
    place = np.searchsorted(times_s, at_s)
    count = 2 * pairs
    around = np.clip(place - pairs, 0, n - count)[:, None] + np.arange(count)  # (m, K)
    since_s = times_s[around] - at_s[:, None]
    # Nothing where the next pose would be: poses come and go without a jump.
    half_s = pairs * step_s
    weight = np.clip(1.0 - np.abs(since_s / half_s) ** 3, 0.0, None) ** 3
    inner = np.clip(place, 1, n - 1)
    known = (
        (place >= 1)
        & (place <= n - 1)
        & (times_s[inner] - times_s[inner - 1] <= max(_MAX_GAP_S, 2.5 * step_s))
        & (np.sum(weight > 1e-3, axis=1) >= _LEAST_POSES)
    )
    weight = np.where(known[:, None], weight, 1.0)
    basis = (since_s / half_s)[..., None] ** np.arange(4)  # (m, K, 4)
    reference = np.take_along_axis(around, np.abs(since_s).argmin(axis=1)[:, None], axis=1)[:, 0]
    R_reference = rotations[reference]
    turn = np.einsum("mji,mkjl->mkil", R_reference, rotations[around]).reshape(-1, 3, 3)
    vectors = Rotation.from_matrix(turn).as_rotvec().reshape(m, count, 3)
    shift = positions_m[around] - positions_m[reference][:, None]
    p = _robust_polynomial(basis, shift, weight)
    r = _robust_polynomial(basis, vectors, weight)
    rotation = R_reference @ Rotation.from_rotvec(r[:, 0]).as_matrix()
    # The rate of a rotation vector c0 is to first order in c0 the angular velocity less c0 x c1/2.
    own_rate = (r[:, 1] - 0.5 * np.cross(r[:, 0], r[:, 1])) / half_s
    found = Motion(
        known,
        positions_m[reference] + p[:, 0],
        rotation,
        p[:, 1] / half_s,
        np.einsum("mij,mj->mi", rotation, own_rate),
    )
    blank = Motion.nowhere(m)
    return Motion(
        *(
            np.where(known.reshape(-1, *[1] * (values.ndim - 1)), values, other)
            for values, other in zip(found, blank, strict=True)
        )
    )


def _robust_polynomial(basis: Array, values: Array, weight: Array) -> Array:
    """Coefficients (m, 4, 3) of values (m, K, 3) in a basis (m, K, 4), weights (m, K)."""
    total = weight
    found = np.zeros((len(basis), 4, 3))
    for _ in range(_ROUNDS):
        weighted = basis * total[..., None]
        normal = np.einsum("mki,mkj->mij", weighted, basis)
        # Far below what any pose adds: keeps what is left out solvable.
        normal = normal + 1e-9 * np.eye(4)
        found = np.linalg.solve(normal, np.einsum("mki,mkj->mij", weighted, values))
        miss = np.linalg.norm(values - basis @ found, axis=2)
        # One scale for the whole path: a window of ten has none of its own.
        usual = max(float(np.median(miss)), 1e-9)
        total = weight / (1.0 + (miss / (_CAUCHY * usual)) ** 2)
    return found
