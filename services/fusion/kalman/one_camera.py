"""A landmark that one camera sees alone: known across its ray, and along it hardly farther than
the hand may have moved since two cameras saw it.

The filter goes on with the velocity it had. Within some tenths of a second that velocity's error
takes the landmark decimetres along the ray, metres within seconds, far outside what its covariance
says, as all of it rests on one straight line through a turn. So the distance from the camera is
told as that of the last sight by two cameras, as unsure as hands move, weighed against the
filter's.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools

# How far a hand's distance changes, 1 sigma: as fast as this at first, never more than so far.
# Tuning motions (sinusoids of .5 m/s, Leap grab, the glove's first 20 s, stop and go at 14 m/s^2),
# one camera gone for 2 s.
_RATE_M_S, _FARTHEST_M = 0.35, 0.12
# The filter's own sigma along the ray is worth half in so long; so it is where a shape is put.
_TRUST_S, _NEEDLE_TRUST_S = 0.1, 0.05
# A needle's sigma along its ray is no more than this: a hand stays before its camera.
_NEEDLE_M = 1.0


class LastLocated:
    """Where each of L landmarks was when two cameras saw it last."""

    def __init__(self, landmarks: int) -> None:
        self._positions = np.full((landmarks, 3), np.nan)
        self._times_s = np.full(landmarks, -np.inf)

    def note(self, located: Bools, positions_m: Array, time_s: float) -> None:
        """Positions (L, 3) of landmarks that two cameras see (L,)."""
        self._positions[located] = positions_m[located]
        self._times_s[located] = time_s

    def told(
        self, row: int, time_s: float, estimate: tuple[Array, Array], centre_rig: Array
    ) -> tuple[Array, Array] | None:
        """The position (3,) and covariance (3, 3) of a landmark by one camera at centre_rig (3,).

        estimate: the filter's. None if two cameras never saw it.
        """
        worn = self._worn(row, time_s, estimate, centre_rig, _TRUST_S)
        return self.held(row, time_s, worn, centre_rig)

    def held(
        self, row: int, time_s: float, estimate: tuple[Array, Array], centre_rig: Array
    ) -> tuple[Array, Array] | None:
        """As told, of an estimate that is as good as it says."""
        return self._between(row, time_s, estimate, centre_rig, _RATE_M_S, _FARTHEST_M)

    def needle(
        self, row: int, time_s: float, estimate: tuple[Array, Array], centre_rig: Array
    ) -> tuple[Array, Array] | None:
        """As told, but with hardly anything said along the ray."""
        worn = self._worn(row, time_s, estimate, centre_rig, _NEEDLE_TRUST_S)
        return self._between(row, time_s, worn, centre_rig, np.inf, _NEEDLE_M)

    def _worn(
        self,
        row: int,
        time_s: float,
        estimate: tuple[Array, Array],
        centre_rig: Array,
        trust_s: float,
    ) -> tuple[Array, Array]:
        """The filter's estimate, less sure along the ray the longer two cameras did not see it."""
        position, cov = estimate
        ray = position - centre_rig
        along = ray / float(np.linalg.norm(ray))
        age_s = max(time_s - self._times_s[row], 0.0)
        if not np.isfinite(age_s):
            return estimate
        more = (1.0 + age_s / trust_s) ** 2 - 1.0
        return position, cov + more * float(along @ cov @ along) * np.outer(along, along)

    def _between(
        self,
        row: int,
        time_s: float,
        estimate: tuple[Array, Array],
        centre_rig: Array,
        rate_m_s: float,
        farthest_m: float,
    ) -> tuple[Array, Array] | None:
        age_s = time_s - self._times_s[row]
        distance = float(np.linalg.norm(self._positions[row] - centre_rig))
        if not (age_s >= 0.0 and np.isfinite(distance)):
            return None
        position, cov = estimate
        ray = position - centre_rig
        own = float(np.linalg.norm(ray))
        along = ray / own
        own_variance = float(along @ cov @ along)
        held_variance = min(rate_m_s * max(age_s, 1e-9), farthest_m) ** 2 + 1e-6
        variance = own_variance * held_variance / (own_variance + held_variance)
        told = variance * (own / own_variance + distance / held_variance)
        across = np.eye(3) - np.outer(along, along)
        told_cov = (told / own) ** 2 * (across @ cov @ across) + variance * np.outer(along, along)
        return centre_rig + told * along, told_cov
