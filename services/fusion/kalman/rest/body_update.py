"""The measurement update of a rigid body: one camera's ray of one of its markers.

The body's motion (18,) and the marker's anchor (3,) take the same innovation. Their
cross-covariance is left out: the full filter was no more exact (offline, the same pictures), and
this one's cost is linear in the markers. Compiled; nothing here raises: what a camera cannot see
gives NOT_VISIBLE and changes nothing.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import project
from services.fusion.kalman.measurement import LOG_2PI, NOT_VISIBLE, Measurement
from services.fusion.kalman.motion_model import Gaussian
from services.fusion.kalman.rest.rigid_body import RestState, place_in_body


@njit(cache=True, error_model="numpy")
def update_body(
    rest: RestState,
    landmark: int,
    dt_s: float,
    measured: Measurement,
    updates_body: bool,
    gate: float,
) -> float:
    """Update a marker's anchor and, if it may, its body; returns the log-likelihood.

    dt_s: of the measurement after the body's time. A squared Mahalanobis distance beyond gate
    changes nothing. The motion's clock error is that of the body's rate.
    """
    hand = rest.hand[landmark]
    anchor = Gaussian(rest.anchor[landmark], rest.anchor_cov[landmark])
    body = Gaussian(rest.motion[hand].reshape(18), rest.cov[hand])
    # Predicted ray, and its Jacobians by the anchor (H) and by the body's displacement (HJ).
    place = np.empty(3)
    J = np.empty((3, 6))
    place_in_body(rest, landmark, dt_s, place, J)
    predicted_ray = np.empty(2)
    H = np.empty((2, 3))
    if not project(place, measured.R, measured.t, predicted_ray, H):
        return NOT_VISIBLE
    HJ = _image_jacobian(H, J)  # (2, 6)
    # Innovation, and its covariance.
    nu = measured.ray - predicted_ray  # (2,)
    anchor_PHt = _anchor_cross_cov(anchor.cov, H)  # (3, 2)
    body_PHt = _body_cross_cov(body.cov, HJ, dt_s)  # (18, 2)
    S = _clock_noise(HJ, rest.motion[hand, 1], measured.clock_variance)  # (2, 2)
    _add_innovation_cov(S, H, anchor_PHt, HJ, body_PHt, dt_s)
    S[0, 0] += measured.ray_variance
    S[1, 1] += measured.ray_variance
    determinant = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    if not determinant > 0.0:
        return NOT_VISIBLE
    S_inverse = np.array([[S[1, 1], -S[0, 1]], [-S[1, 0], S[0, 0]]]) / determinant
    # The order of terms is another than in measurement.mahalanobis_squared: S is symmetric here
    # only to rounding.
    mahalanobis_squared = nu[0] * (S_inverse[0, 0] * nu[0] + S_inverse[0, 1] * nu[1]) + nu[1] * (
        S_inverse[1, 0] * nu[0] + S_inverse[1, 1] * nu[1]
    )
    if mahalanobis_squared <= gate:
        _update(anchor, anchor_PHt, S_inverse, nu)
        if updates_body:
            _update(body, body_PHt, S_inverse, nu)
    return -0.5 * (mahalanobis_squared + math.log(determinant)) - LOG_2PI


@njit(cache=True, error_model="numpy")
def _image_jacobian(H: Array, J: Array) -> Array:
    """H J (2, 6): the Jacobian of a ray by translation and rotation of the body."""
    HJ = np.empty((2, 6))
    for k in range(2):
        for axis in range(6):
            HJ[k, axis] = H[k, 0] * J[0, axis] + H[k, 1] * J[1, axis] + H[k, 2] * J[2, axis]
    return HJ


@njit(cache=True, error_model="numpy")
def _anchor_cross_cov(anchor_cov: Array, H: Array) -> Array:
    """P H^T (3, 2), the cross-covariance of anchor and ray, from P (3, 3)."""
    PHt = np.empty((3, 2))
    for i in range(3):
        for k in range(2):
            PHt[i, k] = (
                anchor_cov[i, 0] * H[k, 0] + anchor_cov[i, 1] * H[k, 1] + anchor_cov[i, 2] * H[k, 2]
            )
    return PHt


@njit(cache=True, error_model="numpy")
def _body_cross_cov(cov: Array, HJ: Array, dt_s: float) -> Array:
    """P H^T (18, 2), that of body and ray, from P (18, 18); H = [HJ, dt HJ, dt^2 / 2 HJ]."""
    half = 0.5 * dt_s * dt_s
    PHt = np.zeros((18, 2))
    for i in range(18):
        for axis in range(6):
            displacement_cov = cov[i, axis] + dt_s * cov[i, 6 + axis] + half * cov[i, 12 + axis]
            PHt[i, 0] += displacement_cov * HJ[0, axis]
            PHt[i, 1] += displacement_cov * HJ[1, axis]
    return PHt


@njit(cache=True, error_model="numpy")
def _clock_noise(HJ: Array, rate: Array, clock_variance: float) -> Array:
    """Covariance (2, 2) of a ray by its camera's clock error (s^2), for a body's rate (6,)."""
    drift = np.zeros(2)
    for k in range(2):
        for axis in range(6):
            drift[k] += HJ[k, axis] * rate[axis]
    noise = np.empty((2, 2))
    for k in range(2):
        for n in range(2):
            noise[k, n] = clock_variance * drift[k] * drift[n]
    return noise


@njit(cache=True, error_model="numpy")
def _add_innovation_cov(
    S: Array, H: Array, anchor_PHt: Array, HJ: Array, body_PHt: Array, dt_s: float
) -> None:
    """Add H P H^T of anchor and body to S (2, 2)."""
    half = 0.5 * dt_s * dt_s
    for k in range(2):
        for n in range(2):
            S[k, n] = (
                S[k, n]
                + H[k, 0] * anchor_PHt[0, n]
                + H[k, 1] * anchor_PHt[1, n]
                + H[k, 2] * anchor_PHt[2, n]
            )
            for axis in range(6):
                S[k, n] += HJ[k, axis] * (
                    body_PHt[axis, n] + dt_s * body_PHt[6 + axis, n] + half * body_PHt[12 + axis, n]
                )


@njit(cache=True, error_model="numpy")
def _update(state: Gaussian, PHt: Array, S_inverse: Array, nu: Array) -> None:
    """The posterior of a state (n,), (n, n), in place: x += K nu, P -= K (P H^T)^T.

    PHt (n, 2) is P H^T; nu (2,) the innovation, S_inverse (2, 2) its inverse covariance.
    """
    x, P = state.mean, state.cov
    n = x.shape[0]
    K = np.empty((n, 2))
    for i in range(n):
        K[i, 0] = PHt[i, 0] * S_inverse[0, 0] + PHt[i, 1] * S_inverse[1, 0]
        K[i, 1] = PHt[i, 0] * S_inverse[0, 1] + PHt[i, 1] * S_inverse[1, 1]
        x[i] += K[i, 0] * nu[0] + K[i, 1] * nu[1]
    for i in range(n):
        for j in range(i, n):
            P[i, j] -= K[i, 0] * PHt[j, 0] + K[i, 1] * PHt[j, 1]
            P[j, i] = P[i, j]
