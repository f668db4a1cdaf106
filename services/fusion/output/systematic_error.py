"""What is wrong with a marker's centre and stays wrong: it does not average out, so sigma must not
shrink as if it did.

A tracker's sigma_px covers all of its error. On rendered hands (sensor noise 5, 0.5 to 1.0 m;
`benchmarks/accuracy.py`), only a part of it changes from frame to frame. Light and shade move the
centre alike for all cameras: that shifts a landmark sideways and leaves its depth alone. What lies
behind the paint bleeds into its blurred edge, differently for each camera: that is an error of
disparity, and it stays as long as the marker keeps its place before the background. So the filter
gets the part that changes, and the two others are added to its covariance when points are told.
Landmarks without extent (synthetic points) have white noise only.

An estimate needs a marker's latest sigma; before the first view it counts as SIGMA_MIN_PX.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.triangulation import extrinsics, invert_symmetric
from services.fusion.intake.observations import View
from services.fusion.kalman.measurement import project
from services.fusion.method import Bools, Ints

# What changes from frame to frame: this much of every marker, and this share of a large sigma
# (never more than sigma itself). At sensor noise 5 a resting centre scatters by .10 px at 1.0 m and
# .16 px at 0.5 m; sigma_px is .08 and .15-.3 there, much of it light. Taking all of it for noise
# made playing fingers at half a metre 1.95 mm RMS without lag, this 1.49, and nothing worse.
WHITE_PX, WHITE_SHARE = 0.1, 0.2
# Steady, each camera's own: depths of resting hands are .27-.34 mm off on average at .5 m and
# 1.06-1.15 at 1.0 m (seeds 1-4, 5-8), .026-.03 px of each view. Squared error over variance is then
# .85-.97 and .81-.88 for resting hands, .88-1.0 for moving ones.
OWN_PX = 0.028
# Steady, shared by all cameras, as a share of sigma_px: with more than this, resting hands' errors
# across the ray (.15-.18 mm RMS at .5 m, .19-.23 at 1.0 m) are smaller than told.
SHARED_SHARE = 0.14
# Share of a new frame's sigma in the running one.
_NEW = 0.1


class Bias:
    """The steady errors of all S landmarks in all C cameras."""

    def __init__(self, extended: Bools, cameras: tuple[Camera, ...]) -> None:
        """extended (S,): the landmark is paint of some size, not a point."""
        self._extended = extended
        self._R, self._t = extrinsics(cameras)
        # Normalised units per px in the middle of each camera's picture.
        self._unit = np.array([1.0 / float(np.mean(camera.focal_px)) for camera in cameras])
        self._own = OWN_PX * self._unit
        self._sigma = np.zeros(len(extended))

    def note(self, view: View) -> Array:
        """Remember how sure a camera is of its markers.

        The part of their sigmas (n,) that changes from frame to frame.
        """
        white = np.empty(len(view.slots))
        _note(
            self._sigma,
            self._extended,
            view.slots,
            view.sigma,
            WHITE_PX * float(self._unit[view.camera]),
            white,
        )
        return white

    def covariances(self, positions_m: Array, seen_by: Bools) -> Array:
        """What to add to the covariances of points (S, 3), (S, 3, 3) m^2.

        seen_by (S, C) tells which cameras located them.
        """
        out = np.zeros((len(positions_m), 3, 3))
        _steady(
            positions_m,
            seen_by,
            self._extended,
            SHARED_SHARE * self._sigma,
            self._own,
            self._R,
            self._t,
            out,
        )
        return out


@njit(cache=True)
def _note(
    running: Array, extended: Bools, slots: Ints, sigma: Array, white: float, out: Array
) -> None:
    """Running sigmas (S,) of the slots (n,) seen with sigma (n,), and their noise (n,) to out.

    White: WHITE_PX in the rays' units.
    """
    for n in range(slots.shape[0]):
        s = slots[n]
        running[s] = sigma[n] if running[s] == 0.0 else (1.0 - _NEW) * running[s] + _NEW * sigma[n]
        out[n] = (
            min(sigma[n], math.hypot(white, WHITE_SHARE * sigma[n])) if extended[s] else sigma[n]
        )


@njit(cache=True)
def _steady(
    positions: Array,
    seen_by: Bools,
    extended: Bools,
    shared: Array,
    own: Array,
    R: Array,
    t: Array,
    out: Array,
) -> None:
    """Own errors: covariance of the least-squares point of the cameras' rays.

    Shared ones: across the first camera's ray.
    """
    A, inverse, ray, H = np.empty((3, 3)), np.empty((3, 3)), np.empty(2), np.empty((2, 3))
    for s in range(positions.shape[0]):
        if not extended[s]:
            continue
        A[:] = 0.0
        all_of_them = np.count_nonzero(seen_by[s]) < 2
        first = True
        for c in range(R.shape[0]):
            if not (seen_by[s, c] or all_of_them) or not project(positions[s], R[c], t[c], ray, H):
                continue
            for i in range(3):
                for j in range(3):
                    A[i, j] += (H[0, i] * H[0, j] + H[1, i] * H[1, j]) / own[c] ** 2
            if first:
                depth = (
                    R[c, 2, 0] * positions[s, 0]
                    + R[c, 2, 1] * positions[s, 1]
                    + R[c, 2, 2] * positions[s, 2]
                    + t[c, 2]
                )
                for i in range(3):
                    for j in range(3):
                        across = (1.0 if i == j else 0.0) - R[c, 2, i] * R[c, 2, j]
                        out[s, i, j] += (shared[s] * depth) ** 2 * across
                first = False
        if invert_symmetric(A, inverse):
            out[s] += inverse
