"""A camera's turn against a plane, from edges of its two directions at right angles.

One fit for both vanishing points and the focal length: with the turn R = (r1 r2 r3), edges along x
meet at K r1 and those along y at K r2, near or at infinity alike. Square to a plane the focal
length cannot be told, and does not matter: a prior keeps it where lenses are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array, rotation_from_vector
from studies.grasp.metrology.fit import Problem, fitted
from studies.grasp.metrology.segments import homogeneous, inverted

# Phones (26 mm equivalent, cropped for video) and webcams (60 to 78 deg) have focal lengths of
# 0.6 to 0.9 widths, zoomed and portrait lenses 1.4; sigma is the logarithm's.
_FOCAL_SHARE, _FOCAL_SIGMA = 0.95, 0.4
# Optical axes miss the picture's middle by 8 and 23 px of 640 (both cameras of stereo_chessboard).
# Taken for the middle, a view at 45 deg had its focal length 9 % off with a sigma of 1 %.
_CENTRE_SHARE = 0.025
# A calibrated lens's focal length and centre are known to this.
_KNOWN_SIGMA, _KNOWN_CENTRE_PX = 0.005, 1.0


class PlaneView(NamedTuple):
    """R_camera_from_plane (3, 3), columns r1, r2 along the plane's x and y, r3 its normal;
    focal_px; centre (2,) px. covariance (6, 6) of a further turn (rad, in the plane's frame), of
    the focal length's logarithm and of the centre (px). inliers: which edges agree.
    """

    R: Array
    focal_px: float
    centre: Array
    covariance: Array
    inliers: npt.NDArray[np.bool_]

    def matrix(self, off: Array) -> Array:
        """Takes (x, y, 1) of the plane, in units of the camera's distance along the plane's normal
        and from the foot of that normal, to homogeneous pixels; (3, 3). off (6,): from the best
        fit, as the covariance is of.
        """
        R = self.R @ rotation_from_vector(off[:3])
        return pinhole_of(self.focal_px * float(np.exp(off[3])), self.centre + off[4:]) @ R


def view_from_edges(
    along_x: npt.ArrayLike,
    along_y: npt.ArrayLike,
    size_px: tuple[int, int],
    *,
    sigma_px: float = 0.5,
    matrix: Array | None = None,
) -> PlaneView:
    """The view of a plane from segments (n, 2, 2) along its x and (m, 2, 2) along its y, in a
    picture without distortion. matrix: the lens's, where it is calibrated.

    Huber's weights; CalibrationError where a direction has too few edges or they are one line.
    """
    groups = [np.asarray(one, dtype=np.float64).reshape(-1, 2, 2) for one in (along_x, along_y)]
    for name, group in zip("xy", groups, strict=True):
        if len(group) < 2:
            raise CalibrationError(
                f"the direction {name} has {len(group)} edges, and needs 2 that are parallel and"
                " apart; give more"
            )
    prior = lens_prior(size_px, matrix)
    view = PlaneView(_first_turn(groups), prior.focal, prior.centre, np.eye(6), np.zeros(0, bool))

    def residuals(view: PlaneView) -> Array:
        off = _misses(groups, view.matrix(np.zeros(6))) / sigma_px
        return np.concatenate([off, prior.misses(view.focal_px, view.centre)])

    view, information = fitted(Problem(6, 3), view, residuals, _moved)
    inliers = np.abs(residuals(view)[:-3]) < 3.0
    return view._replace(covariance=inverted(information), inliers=inliers)


def _moved(view: PlaneView, step: Array) -> PlaneView:
    return view._replace(
        R=view.R @ rotation_from_vector(step[:3]),
        focal_px=view.focal_px * float(np.exp(step[3])),
        centre=view.centre + step[4:],
    )


def common_lens(views: Sequence[PlaneView], size_px: tuple[int, int]) -> Array:
    """The lens (3, 3) that several views of one camera agree on, each fitted without one: the mean
    of focal length's logarithm and centre, weighted by what each view adds to the prior.
    """
    prior = lens_prior(size_px, None)
    expected = np.array([np.log(prior.focal), *prior.centre])
    sigma = np.array([prior.focal_sigma, prior.centre_sigma, prior.centre_sigma])
    known = np.diag(sigma**-2)
    information, weighted = known, known @ expected
    for view in views:
        found = np.array([np.log(view.focal_px), *view.centre])
        own = inverted(view.covariance[3:, 3:])
        information = information + own - known
        weighted = weighted + own @ found - known @ expected
    log_focal, *centre = inverted(information) @ weighted
    return pinhole_of(float(np.exp(log_focal)), np.array(centre))


class LensPrior(NamedTuple):
    """Focal length in px with its logarithm's sigma, centre (2,) px with its sigma."""

    focal: float
    focal_sigma: float
    centre: Array
    centre_sigma: float

    def misses(self, focal_px: float, centre: Array) -> Array:
        """How far a lens is from it, in sigmas; (3,)."""
        off = np.log(focal_px / self.focal) / self.focal_sigma
        return np.append(off, (centre - self.centre) / self.centre_sigma)


def lens_prior(size_px: tuple[int, int], matrix: Array | None) -> LensPrior:
    """What is known of the lens before an edge is seen."""
    if matrix is None:
        longer = max(size_px)
        middle = np.array([(size_px[0] - 1) / 2.0, (size_px[1] - 1) / 2.0])
        return LensPrior(_FOCAL_SHARE * longer, _FOCAL_SIGMA, middle, _CENTRE_SHARE * longer)
    focal = float(np.sqrt(matrix[0, 0] * matrix[1, 1]))
    return LensPrior(focal, _KNOWN_SIGMA, matrix[:2, 2].copy(), _KNOWN_CENTRE_PX)


def pinhole_of(focal_px: float, centre: Array) -> Array:
    """A lens's matrix (3, 3)."""
    return np.array([[focal_px, 0.0, centre[0]], [0.0, focal_px, centre[1]], [0.0, 0.0, 1.0]])


def _misses(groups: list[Array], H: Array) -> Array:
    """How far ends lie from the lines to the vanishing points; (n + m,) px."""
    found = []
    for axis, group in enumerate(groups):
        line = np.cross(homogeneous(group.mean(axis=1)), H[:, axis])
        size = np.maximum(np.hypot(line[:, 0], line[:, 1]), 1e-12)
        found.append(np.sqrt(2.0) * (line * homogeneous(group[:, 0])).sum(axis=1) / size)
    return np.concatenate(found)


def _first_turn(groups: list[Array]) -> Array:
    """From the mean direction of each group: the plane seen squarely."""
    directions = []
    for group in groups:
        along = group[:, 1] - group[:, 0]
        doubled = (along[:, 0] + 1j * along[:, 1]) ** 2
        directions.append(0.5 * np.angle(doubled.sum()))
    x = directions[0]
    c, s = np.cos(x), np.sin(x)
    # y is a quarter turn from x, to the side that its edges have.
    side = 1.0 if np.sin(directions[1] - x) >= 0.0 else -1.0
    return np.array([[c, -s * side, 0.0], [s, c * side, 0.0], [0.0, 0.0, side]])
