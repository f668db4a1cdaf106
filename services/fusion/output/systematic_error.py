"""The systematic error of a marker's centre, which does not average out over frames.

Sigma must not shrink as if it did. A tracker's sigma_px covers all of its error. On rendered hands
(sensor noise 5, 0.5 to 1.0 m; `benchmarks/accuracy.py`), only a part of it changes from frame to
frame: the white noise. The rest is systematic, of two kinds. Light and shade move the centre alike
for all cameras: that shifts a landmark sideways and leaves its depth alone. What lies behind the
paint bleeds into its blurred edge, differently for each camera: that is an error of disparity, and
it stays as long as the marker keeps its place before the background.

So the filter gets the white part, and the two others are added to its covariance when points are
put out. Landmarks without extent (synthetic points) have white noise only. An estimate needs a
marker's latest sigma; before the first view it counts as 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.normal_equations import invert_symmetric
from services.fusion.geometry.projection import Extrinsics, project
from services.fusion.intake.observations import View

# What changes from frame to frame: this much of every marker, and this share of a large sigma
# (never more than sigma itself). At sensor noise 5 a resting centre scatters by .10 px at 1.0 m and
# .16 px at 0.5 m; sigma_px is .08 and .15-.3 there, much of it light. Taking all of it for noise
# made playing fingers at half a metre 1.95 mm RMS without lag, this 1.49, and nothing worse.
WHITE_PX, WHITE_SHARE = 0.1, 0.2
# Systematic, each camera's own: depths of resting hands are .27-.34 mm off on average at .5 m and
# 1.06-1.15 at 1.0 m (seeds 1-4, 5-8), .026-.03 px of each view. Squared error over variance is then
# .85-.97 and .81-.88 for resting hands, .88-1.0 for moving ones.
OWN_PX = 0.028
# Systematic, shared by all cameras, as a share of sigma_px: with more than this, resting hands'
# errors across the ray (.15-.18 mm RMS at .5 m, .19-.23 at 1.0 m) are smaller than sigma says.
SHARED_SHARE = 0.14
# What hides paint from all cameras is so much each camera's own. (Tuning halves of held_out.py and
# other_renderer.py: the same to 1 % with .4.)
OWN_SHARE = 0.2
# Share of a new frame's sigma in the running one.
_NEW = 0.1


class Systematic(NamedTuple):
    """What is known of the systematic errors of L landmarks' rays in C cameras."""

    running: Array  # (L,) sigma of a marker, over its last views
    own: Array  # (C,) each camera's error, where no paint is hidden
    extended: Bools  # (L,) the landmark is paint of some size, not a point


class SystematicError:
    """The systematic errors of all L landmarks in all C cameras."""

    def __init__(self, extended: Bools, cameras: tuple[Camera, ...]) -> None:
        """extended (L,): the landmark is paint of some size, not a point."""
        # Normalised units per px in the middle of each camera's image.
        unit = np.array([1.0 / float(np.mean(camera.focal_px)) for camera in cameras])
        self._floors: list[float] = (WHITE_PX * unit).tolist()
        self.known = Systematic(np.zeros(len(extended)), OWN_PX * unit, extended)

    def white_sigmas(self, view: View, hidden: Array) -> Array:
        """What changes of a view's rays from frame to frame, one standard deviation (n,).

        That is a part of its sigmas, which are remembered, and what hidden paint adds (n,).
        """
        floor = self._floors[view.camera]
        known, white = self.known, np.empty(len(view.landmarks))
        _white_sigmas(
            known.running, known.extended, view.landmarks, view.sigmas, hidden, floor, white
        )
        return white


@njit(cache=True)
def _white_sigmas(
    running: Array,
    extended: Bools,
    landmarks: Ints,
    sigmas: Array,
    hidden: Array,
    floor: float,
    white: Array,
) -> None:
    """SystematicError.white_sigmas to white (n,); floor: WHITE_PX in the rays' units."""
    for n in range(landmarks.shape[0]):
        row, sigma = landmarks[n], sigmas[n]
        running[row] = sigma if running[row] == 0.0 else (1.0 - _NEW) * running[row] + _NEW * sigma
        if extended[row]:
            sigma = min(sigma, math.hypot(floor, WHITE_SHARE * sigma))
        white[n] = math.hypot(sigma, hidden[n])


@njit(cache=True)
def add_systematic(
    known: Systematic,
    hidden: Array,
    positions: Array,
    seen_by: Bools,
    cameras: Extrinsics,
    covs: Array,
) -> None:
    """Add the covariances of points (L, 3) by their systematic errors to covs (L, 3, 3).

    Own errors: the covariance of the least-squares point of the cameras' rays. Shared ones: across
    the first camera's optical axis. seen_by (L, C) tells which cameras located a point; one that
    fewer than two did counts as seen by all; one without extent has none. hidden (2, L, C): how far
    each ray may be off since paint is hidden from it, and all of them as it is from all
    (hidden_paint.py).
    """
    R, t = cameras.R, cameras.t
    A = np.empty((3, 3))  # H^T H / own^2, summed
    A_inverse = np.empty((3, 3))
    ray = np.empty(2)
    H = np.empty((2, 3))
    for row in range(positions.shape[0]):
        if not known.extended[row]:
            continue
        p_rig = positions[row]
        by_all = np.count_nonzero(seen_by[row]) < 2
        first, shared = -1, 0.0
        A[:] = 0.0
        for c in range(R.shape[0]):
            if not (seen_by[row, c] or by_all) or not project(p_rig, R[c], t[c], ray, H):
                continue
            own = math.hypot(known.own[c], hidden[0, row, c])
            own = math.hypot(own, OWN_SHARE * hidden[1, row, c])
            for i in range(3):
                for j in range(3):
                    A[i, j] += (H[0, i] * H[0, j] + H[1, i] * H[1, j]) / own**2
            first = c if first < 0 else first
            shared = max(shared, hidden[1, row, c])
        if first >= 0:
            shared = math.hypot(SHARED_SHARE * known.running[row], shared)
            _add_shared_error(p_rig, shared, R[first], t[first], covs[row])
        if invert_symmetric(A, A_inverse):
            covs[row] += A_inverse


@njit(cache=True)
def _add_shared_error(p_rig: Array, sigma: float, R: Array, t: Array, cov: Array) -> None:
    """Add the covariance of a ray's error that all cameras share, at a point, to cov (3, 3).

    R (3, 3), t (3,): T_camera_from_rig.
    """
    depth = R[2, 0] * p_rig[0] + R[2, 1] * p_rig[1] + R[2, 2] * p_rig[2] + t[2]
    for i in range(3):
        for j in range(3):
            across = (1.0 if i == j else 0.0) - R[2, i] * R[2, j]
            cov[i, j] += (sigma * depth) ** 2 * across
