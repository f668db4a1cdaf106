"""Above a reference plane: heights, planes parallel to it, and points carried between them.

Criminisi, Reid & Zisserman 2000, section 4; the finger paper's A2: alpha Z = -|b x t| /
((l . b) |v x t|) for a base b and a top t, with l the reference plane's vanishing line and v the
vanishing point of its normal. The paper prints (1 . x) for (l . x).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from studies.grasp.metrology.plane import Plane, checked_length
from studies.grasp.metrology.segments import homogeneous, inverted
from studies.grasp.metrology.uncertainty import jacobian, propagated, sigma_steps


class Space(NamedTuple):
    """reference: the plane; rise (3,): alpha v, what a millimetre along its normal adds to a
    point's homogeneous image; covariance (12, 12) of the plane's matrix, row by row, and of rise.
    """

    reference: Plane
    rise: Array
    covariance: Array

    def parallel_plane(self, height_mm: float) -> Plane:
        """The plane at a height: the homography is H + Z alpha v (0 0 1)."""

        def raised(x: Array) -> Array:
            H = x[:9].reshape(3, 3).copy()
            H[:, 2] += height_mm * x[9:]
            return (H / np.linalg.norm(H)).reshape(-1)

        H, covariance = propagated(raised, self._parameters(), self.covariance)
        return Plane(H.reshape(3, 3), covariance)

    def homology(self, height_mm: float) -> Array:
        """Takes images of points of the reference plane to images of the points right above them:
        the planar homology I + Z alpha v l^T with vertex v and axis l; (3, 3).
        """
        above = self.parallel_plane(height_mm).image_from_plane
        H = above @ inverted(self.reference.image_from_plane)
        return H / np.linalg.norm(H)

    def height(
        self, base_px: npt.ArrayLike, top_px: npt.ArrayLike, sigma_px: float = 0.5
    ) -> tuple[float, float]:
        """Of a top (2,) above a base (2,) that lies in the reference plane: mm, and its standard
        deviation. Negative below.
        """

        def found(x: Array) -> Array:
            return np.array([_height(x[:9].reshape(3, 3), x[9:12], x[12:14], x[14:16])])

        covariance = np.zeros((16, 16))
        covariance[:12, :12] = self.covariance
        np.fill_diagonal(covariance[12:, 12:], sigma_px**2)
        ends = np.concatenate([np.asarray(base_px), np.asarray(top_px)]).astype(np.float64)
        value, spread = propagated(found, np.concatenate([self._parameters(), ends]), covariance)
        return float(value[0]), float(np.sqrt(spread[0, 0]))

    def _parameters(self) -> Array:
        return np.concatenate([self.reference.image_from_plane.reshape(-1), self.rise])


def space_from_lens(plane: Plane, matrix: Array) -> Space:
    """The normal from a calibrated lens (3, 3): a plane's homography K (r1 r2 t) says r3."""

    def rise(x: Array) -> Array:
        r = inverted(matrix) @ x.reshape(3, 3)
        # Away from the camera, as right-handed axes have z where x is right and y down.
        normal = np.cross(r[:, 0], r[:, 1])
        size = np.sqrt(np.linalg.norm(r[:, 0]) * np.linalg.norm(r[:, 1]))
        return matrix @ normal / size

    H = plane.image_from_plane.reshape(-1)
    return _joined(plane, rise(H), jacobian(rise, H, sigma_steps(plane.covariance)))


def space_from_height(
    plane: Plane,
    vertical: npt.ArrayLike,
    base_px: npt.ArrayLike,
    top_px: npt.ArrayLike,
    height_mm: float,
    sigma_px: float = 0.5,
) -> Space:
    """The normal's scale from a reference height: a base (2,) in the plane, the top (2,) above it,
    and the vanishing point (3,) of the normal in homogeneous pixels.
    """
    length = checked_length(abs(height_mm), "the reference height") * np.sign(height_mm)
    v = np.asarray(vertical, dtype=np.float64)
    v = v / np.linalg.norm(v)
    ends = np.concatenate([np.asarray(base_px), np.asarray(top_px)]).astype(np.float64)
    if np.hypot(*(ends[2:] - ends[:2])) < 2.0 * sigma_px:
        raise CalibrationError(
            "the reference height's ends are the same point in the picture; the camera looks along"
            " it: choose one that is seen from the side"
        )

    def rise(x: Array) -> Array:
        return v * _height(x[:9].reshape(3, 3), v, x[9:11], x[11:13]) / length

    at = np.concatenate([plane.image_from_plane.reshape(-1), ends])
    steps = np.append(sigma_steps(plane.covariance), np.full(4, 0.01 * sigma_px))
    J = jacobian(rise, at, steps)
    space = _joined(plane, rise(at), J[:, :9])
    space.covariance[9:, 9:] += sigma_px**2 * J[:, 9:] @ J[:, 9:].T
    return space


def _joined(plane: Plane, rise: Array, J: Array) -> Space:
    """With what rise (3,) has of the plane's uncertainty by J (3, 9)."""
    both = np.concatenate([np.eye(9), J])
    return Space(plane, rise, both @ plane.covariance @ both.T)


def _height(H: Array, rise: Array, base: Array, top: Array) -> float:
    """How many rises (3,) take the image of a base (2,) to that of a top (2,)."""
    b, t = homogeneous(base)[0], homogeneous(top)[0]
    # In the homography's own scale the base's image is w b, with w from the vanishing line.
    w = 1.0 / float((inverted(H) @ b)[2])
    across, along = np.cross(w * b, t), np.cross(rise, t)
    return -float(across @ along) / float(along @ along)
