"""One marker as one camera followed it: rays over time, interpolated to any instant. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array

# Nothing is known between samples further apart than this many usual steps; a lost frame is 2.
_GAP_STEPS = 2.5
# An outlier lies this many times the usual deviation from its neighbours (motion is a part of
# that), and at least so far: 5 px at the usual lens.
_OUTLIER_FACTOR, _OUTLIER_MIN = 8.0, 0.01


@dataclass(frozen=True, eq=False)
class Track:
    """Times (n,) s on the master's clock, ascending, and undistorted rays (n, 2)."""

    times_s: Array
    rays: Array

    def interpolate(self, times_s: Array) -> Array:
        """Rays (m, 2) at instants (m,); NaN where four samples do not enclose them."""
        n = len(self.times_s)
        found = np.full((len(times_s), 2), np.nan)
        if n < 4:
            return found
        place = np.searchsorted(self.times_s, times_s, side="right")
        inside = (place >= 2) & (place <= n - 2)
        around = np.clip(place, 2, n - 2)[:, None] + np.arange(-2, 2)  # (m, 4)
        times, rays = self.times_s[around], self.rays[around]
        steps = np.diff(times, axis=1)
        inside &= steps.max(axis=1) <= _GAP_STEPS * float(np.median(np.diff(self.times_s)))
        value = _cubic(times, rays, times_s)
        found[inside] = value[inside]
        return found

    def without_outliers(self) -> Track:
        """Without samples far from the cubic through their four neighbours: wrong markers."""
        n = len(self.times_s)
        if n < 5:
            return self
        middle = np.clip(np.arange(n), 2, n - 3)
        around = middle[:, None] + np.array([-2, -1, 1, 2])  # (n, 4)
        expected = _cubic(self.times_s[around], self.rays[around], self.times_s[middle])
        error = np.linalg.norm(expected - self.rays[middle], axis=1)
        keep = error <= max(_OUTLIER_FACTOR * float(np.median(error)), _OUTLIER_MIN)
        return Track(self.times_s[keep], self.rays[keep])


def _cubic(times_s: Array, samples: Array, at_s: Array) -> Array:
    """Values (m, 2) at instants (m,) of the cubics through four samples (m, 4, 2) at times (m, 4).

    Lagrange's form.
    """
    weights = np.ones_like(times_s)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[:, i] *= (at_s - times_s[:, j]) / (times_s[:, i] - times_s[:, j])
    return np.einsum("mk,mki->mi", weights, samples)
