"""All dots in one Kalman filter: constant velocity, accelerations that dots of one hand share.

The state of n dots is (2n, 2): n positions and n velocities, columns x and y; both axes have one
covariance (2n, 2n). A hand moves as a whole and fingers bend about their joints, so where one dot
goes says where the others go (chains.py): a dot that is hidden is carried by its neighbours, and a
patch is judged against where the others say that its dot is. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# Velocities fade with this time constant: a hand that turns round is nearer to resting than to
# going on.
_VELOCITY_TIME_S = 0.25


class State(NamedTuple):
    """Mean (2n, 2) px and px/s, and covariance (2n, 2n) of each axis."""

    mean: Array
    cov: Array

    @property
    def positions(self) -> Array:
        """(n, 2)"""
        return self.mean[: len(self.mean) // 2]


class Innovation(NamedTuple):
    """What m measured dots say against their prediction."""

    dots: Indices  # (m,)
    residuals: Array  # (m, 2) px
    inverse: Array  # (m, m) of the residuals' covariance
    log_det: float

    @property
    def squared(self) -> float:
        """Squared Mahalanobis distance; of 2m degrees of freedom."""
        return float(np.sum(self.residuals * (self.inverse @ self.residuals)))

    @property
    def log_likelihood(self) -> float:
        """Log density per px^(2m)."""
        count = len(self.dots)
        return -0.5 * self.squared - self.log_det - count * float(np.log(2.0 * np.pi))


def start(positions: Array, sigmas: Array, speed: float) -> State:
    """Dots at positions (n, 2) with sigmas (n,), and any velocity about `speed` px/s."""
    count = len(positions)
    mean = np.concatenate([positions, np.zeros((count, 2))])
    # They move together, mostly.
    velocity = speed**2 * (0.8 + 0.2 * np.eye(count))
    cov = np.zeros((2 * count, 2 * count))
    cov[:count, :count] = np.diag(sigmas**2)
    cov[count:, count:] = velocity
    return State(mean, cov)


def predict(state: State, elapsed_s: float, acceleration: Array) -> State:
    """The state after a time; acceleration (n, n) is a covariance in (px/s^2)^2."""
    count = len(state.mean) // 2
    fade = float(np.exp(-elapsed_s / _VELOCITY_TIME_S))
    # How far a velocity that fades carries.
    reach_s = _VELOCITY_TIME_S * (1.0 - fade)
    mean = state.mean.copy()
    mean[:count] += reach_s * state.mean[count:]
    mean[count:] *= fade
    pp, pv, vv = state.cov[:count, :count], state.cov[:count, count:], state.cov[count:, count:]
    cov = np.empty_like(state.cov)
    cov[:count, :count] = pp + reach_s * (pv + pv.T) + reach_s**2 * vv
    cov[:count, count:] = fade * (pv + reach_s * vv)
    cov[count:, count:] = fade**2 * vv
    # A constant acceleration for the whole time.
    cov[:count, :count] += 0.25 * elapsed_s**4 * acceleration
    cov[:count, count:] += 0.5 * elapsed_s**3 * acceleration
    cov[count:, count:] += elapsed_s**2 * acceleration
    cov[count:, :count] = cov[:count, count:].T
    return State(mean, cov)


def innovate(state: State, dots: Indices, measured: Array, variances: Array) -> Innovation:
    """Dots (m,) measured at (m, 2) with variances (m,) of each coordinate."""
    cov = state.cov[dots[:, None], dots] + np.diag(variances)
    inverse: Array = np.asarray(np.linalg.inv(cov), np.float64)
    log_det = float(np.linalg.slogdet(cov)[1])
    return Innovation(dots, measured - state.mean[dots], inverse, log_det)


def update(state: State, innovation: Innovation) -> State:
    """The state with the measurements taken in."""
    cross = state.cov[:, innovation.dots]  # (2n, m)
    gain = cross @ innovation.inverse
    cov = state.cov - gain @ cross.T
    return State(state.mean + gain @ innovation.residuals, 0.5 * (cov + cov.T))


def expected(state: State, innovation: Innovation, variances: Array) -> tuple[Array, Array]:
    """Where each dot (n, 2) must be measured by all the others, and the variance (n,) of that.

    Of a measured dot its own measurement counts nothing; variances (n,) are what each would be
    measured with.
    """
    count = len(state.mean) // 2
    cross = state.cov[:count, innovation.dots]
    gain = cross @ innovation.inverse
    places = state.mean[:count] + gain @ innovation.residuals
    spread = np.diag(state.cov)[:count] - np.sum(gain * cross, axis=1) + variances
    own = np.diag(innovation.inverse)  # (m,)
    left_out = (innovation.inverse @ innovation.residuals) / own[:, None]
    measured = state.mean[innovation.dots] + innovation.residuals
    places[innovation.dots] = measured - left_out
    spread[innovation.dots] = 1.0 / own
    return places, np.maximum(spread, variances)


def bound_bones(state: State, bones: Indices, lengths: Array) -> State:
    """The state, knowing that bones (b, 2) are no longer than lengths (b,) px.

    A bone whose variance has grown beyond that is measured as what it is, with that variance.
    """
    near, far = bones[:, 0], bones[:, 1]
    diagonal = np.diag(state.cov)
    spread = diagonal[near] + diagonal[far] - 2.0 * state.cov[near, far]
    for number in np.flatnonzero(spread > 0.5 * lengths**2).tolist():
        parent, child = int(near[number]), int(far[number])
        bone = state.mean[child] - state.mean[parent]
        size = float(np.hypot(*bone))
        target = bone * min(1.0, float(lengths[number]) / max(size, 1e-9))
        cross = state.cov[:, child] - state.cov[:, parent]
        variance = float(cross[child] - cross[parent])
        gain = cross / (variance + 0.5 * float(lengths[number]) ** 2)
        mean = state.mean + np.outer(gain, target - bone)
        state = State(mean, state.cov - np.outer(gain, cross))
    return state
