"""All numbers of a pose in one compiled call: digits, joints, sigmas, rounded as they go out.

One call, since what a step touches is cold by the time of the next message: each call from Python
costs as much as some joints.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Packed, unowned
from services.solver.error_effect import Errors, effect_at, told_misfit, variances
from services.solver.finger.solve_fingers import (
    Bools,
    FingerSolution,
    solve_dls,
    tips_in_wrist,
)
from services.solver.maths.chains import HandChains
from services.solver.maths.kinematics import hand_frames
from services.solver.maths.quaternions import quaternions_from_rotations
from services.solver.model_error import ErrorsAt
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.landmarks import Observed, Places, observations_of, places_at
from services.solver.whole_hand.update import known_at

# Micrometres and microradians: a thousandth of what the landmarks are good for.
_DECIMALS = 6
_UNITS = 10.0**_DECIMALS
# Where the numbers of a pose are: joints (x, y, z, w, x, y, z), digits (four angles, distance left,
# iterations, outcome, sigma), the wrist (sigmas of position and rotation, the model's misfit).
JOINT_ROWS, DIGIT_ROWS, WRIST_ROW = slice(0, 26), slice(26, 31), 31
_ROWS, _COLUMNS = 32, 8
_DIGIT_0 = DIGIT_ROWS.start
# Half a turn and a metre say: unknown.
_UNKNOWN_RAD, _UNKNOWN_M = math.pi, 1.0


def dls_numbers(
    packed: Packed,
    places: Packed,
    observed: Observed,
    whitening: Array,
    estimate: HandEstimate,
    errors: ErrorsAt,
    options: tuple[int, float],
) -> Array:
    """`pose_numbers` of an estimate whose digits are solved by dls.

    packed: update.Known. whitening (m, 3, 3), as in Observations, of the landmarks observed, which
    sit at places (PLACES). errors: as `variances` takes them, packed. options: iterations and
    tolerance (m).
    """
    numbers = np.empty((_ROWS, _COLUMNS))
    _dls_numbers_unpacked(
        numbers,
        packed.address,
        places.address,
        observed.points_m,
        observed.covariances_m2,
        observed.measured,
        whitening,
        *estimate,
        errors.effect.address,
        errors.landmark_m2,
        errors.keep,
        *options,
    )
    return numbers


@njit(cache=True)
def _dls_numbers_unpacked(
    numbers: Array,
    address: int,
    places: int,
    points_m: Array,
    covariances_m2: Array,
    measured: Bools,
    whitening: Array,
    rotation: Array,
    position_m: Array,
    angles: Array,
    covariance: Array,
    cost: float,
    used: int,
    effect: int,
    landmark_m2: tuple[float, float],
    keep: float,
    max_iterations: int,
    tolerance_m: float,
) -> None:
    """`dls_numbers` with plain arrays for its tuples, of which numba takes four times as long, and
    for what it returns.
    """
    chains, wrist = known_at(address).chains, unowned((rotation, position_m))
    sit: Places = places_at(places)
    tips = tips_in_wrist(wrist, (sit.tip, points_m, covariances_m2, measured))
    fingers = solve_dls(chains, angles, tips, max_iterations, tolerance_m)
    estimate = HandEstimate(rotation, position_m, angles, covariance, cost, used)
    observations = observations_of(sit, points_m, whitening)
    errors = Errors(effect_at(effect), landmark_m2, keep)
    spread = variances(chains, observations, estimate, errors)
    numbers[:] = pose_numbers(chains, wrist, fingers, spread, told_misfit(errors))


@njit(cache=True)
def pose_numbers(
    chains: HandChains,
    wrist: tuple[Array, Array],
    fingers: FingerSolution,
    variances: Array,
    misfit: float,
) -> Array:
    """Joints of a wrist (rotation (3, 3), position (3,)) and solved digits, in rows; (32, 8).

    variances (26,) of rotation, position and angles; misfit: of told_misfit.
    """
    numbers = np.zeros((_ROWS, _COLUMNS))
    angles = rounded_within_limits(fingers.angles_rad, chains.limits_rad)
    positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
    hand_frames(chains, wrist[0], wrist[1], angles, positions, rotations)
    quaternions = quaternions_from_rotations(rotations)
    _write_rows(
        numbers,
        angles,
        (positions, quaternions),
        fingers,
        standard_deviations(variances, chains.limits_rad),
    )
    numbers[WRIST_ROW, 2] = rounded(misfit)
    return numbers


@njit(cache=True)
def _write_rows(
    numbers: Array,
    angles: Array,
    joints: tuple[Array, Array],
    fingers: FingerSolution,
    sigmas: Array,
) -> None:
    """Joints (positions (26, 3), quaternions (26, 4)), digits and sigmas (7,) into their rows."""
    numbers, angles, sigmas = unowned((numbers, angles, sigmas))
    (positions, quaternions), fingers = unowned((joints, fingers))
    for joint in range(26):
        for i in range(3):
            numbers[joint, i] = rounded(positions[joint, i])
        for i in range(4):
            numbers[joint, 3 + i] = rounded(quaternions[joint, i])
    for row in range(5):
        digit = numbers[_DIGIT_0 + row]
        digit[:4] = angles[row]
        digit[4] = rounded(fingers.ends[row, 1])
        digit[5] = fingers.ends[row, 0]
        digit[6] = fingers.status[row]
        digit[7] = rounded(min(sigmas[2 + row], _UNKNOWN_RAD))
    numbers[WRIST_ROW, 0] = rounded(min(sigmas[0], _UNKNOWN_M))
    numbers[WRIST_ROW, 1] = rounded(min(sigmas[1], _UNKNOWN_RAD))


@njit(cache=True)
def rounded(value: float) -> float:
    """Rounded for the wire, without a negative zero."""
    return np.rint(value * _UNITS) / _UNITS + 0.0


@njit(cache=True)
def rounded_within_limits(angles: Array, limits: Array) -> Array:
    """Angles (5, 4) as they go out: rounded, and still within limits (5, 4, 2).

    Rounding alone would cross a limit here and there.
    """
    inside = np.empty((5, 4))
    for row in range(5):
        for k in range(4):
            near = max(rounded(angles[row, k]), limits[row, k, 0])
            inside[row, k] = min(near, limits[row, k, 1]) + 0.0
    return inside


@njit(cache=True)
def standard_deviations(variances: Array, limits: Array) -> Array:
    """Of the wrist's position and rotation, as lengths, and of each digit's angles (7,).

    variances (26,) of a pose; limits (5, 4, 2) tell which angles can move.
    """
    found = np.zeros(7)
    for i in range(3):
        found[0] += max(variances[3 + i], 0.0)
        found[1] += max(variances[i], 0.0)
    for row in range(5):
        movable = 0
        for j in range(4):
            if limits[row, j, 1] > limits[row, j, 0]:
                angle = 6 + 4 * row + j
                movable += 1
                found[2 + row] += max(variances[angle], 0.0)
        found[2 + row] /= max(movable, 1)
    return np.sqrt(found)
