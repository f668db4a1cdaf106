"""A plane of the world in a picture: pixels to mm, distances, each with its uncertainty.

image_from_plane takes (x, y, 1) in mm to homogeneous pixels of a picture without distortion
(planar homology and homography: Criminisi, Reid & Zisserman 2000, sections 3 and 4).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from studies.grasp.metrology.segments import homogeneous, inverted
from studies.grasp.metrology.uncertainty import jacobian, propagated
from studies.grasp.metrology.view import PlaneView

# Corners whose smallest triangle has less height than this share of the longest side are as good
# as in a line: an error of a pixel in 100 px then turns the plane by more than it can be told.
_FLATTEST = 0.02
# Fingers are centimetres: lengths beyond these are given in another unit than mm.
_SHORTEST_MM, _LONGEST_MM = 1.0, 5000.0

# What is measured of points in mm: (n, 2) -> (m,).
Measure = Callable[[Array], Array]


class Plane(NamedTuple):
    """image_from_plane (3, 3) as above, of norm 1; covariance (9, 9) of it, row by row."""

    image_from_plane: Array
    covariance: Array

    def to_mm(self, points_px: npt.ArrayLike) -> Array:
        """(n, 2) px -> (n, 2) mm."""
        return project(inverted(self.image_from_plane), points_px)

    def to_px(self, points_mm: npt.ArrayLike) -> Array:
        """(n, 2) mm -> (n, 2) px."""
        return project(self.image_from_plane, points_mm)

    def measured(
        self, points_px: npt.ArrayLike, sigma_px: float, result: Measure
    ) -> tuple[Array, Array]:
        """What a function of points in mm gives for points (n, 2) in px, which are uncertain by
        sigma_px along each axis, as the plane is: (m,), and its covariance (m, m).
        """
        points = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)

        def whole(x: Array) -> Array:
            back = inverted(x[:9].reshape(3, 3))
            return result(project(back, x[9:].reshape(-1, 2)))

        covariance = np.zeros((9 + points.size, 9 + points.size))
        covariance[:9, :9] = self.covariance
        np.fill_diagonal(covariance[9:, 9:], sigma_px**2)
        at = np.concatenate([self.image_from_plane.reshape(-1), points.reshape(-1)])
        return propagated(whole, at, covariance)

    def distance(
        self, from_px: npt.ArrayLike, to_px: npt.ArrayLike, sigma_px: float = 0.5
    ) -> tuple[float, float]:
        """Between two points of the plane (2,) px: mm, and its standard deviation."""
        both = np.stack([np.asarray(from_px), np.asarray(to_px)])
        value, covariance = self.measured(
            both, sigma_px, lambda mm: np.array([np.hypot(*(mm[1] - mm[0]))])
        )
        return float(value[0]), float(np.sqrt(covariance[0, 0]))

    @property
    def vanishing_line(self) -> Array:
        """The image of the plane's points at infinity, (3,) in homogeneous pixels, unit."""
        H = self.image_from_plane
        line = np.cross(H[:, 0], H[:, 1])
        return line / np.linalg.norm(line)


def project(H: Array, points: npt.ArrayLike) -> Array:
    """(n, 2) -> (n, 2) by a homography (3, 3)."""
    flat = homogeneous(points) @ H.T
    return flat[:, :2] / flat[:, 2:]


def checked_length(length_mm: float, what: str) -> float:
    """A reference length in mm; CalibrationError where it cannot be one."""
    if not np.isfinite(length_mm) or length_mm <= 0.0:
        raise CalibrationError(
            f"{what} is {length_mm:g} mm long, which is no length; measure it with a ruler and give"
            " it in mm"
        )
    if length_mm < _SHORTEST_MM:
        raise CalibrationError(
            f"{what} is {length_mm:g} mm long, which looks like metres: lengths are given in mm"
            f" (did you mean {1000.0 * length_mm:g}?)"
        )
    if length_mm > _LONGEST_MM:
        raise CalibrationError(
            f"{what} is {length_mm:g} mm long, too long beside a hand: lengths are given in mm,"
            f" {_SHORTEST_MM:g} to {_LONGEST_MM:g}"
        )
    return float(length_mm)


def plane_from_rectangle(
    corners_px: npt.ArrayLike, size_mm: tuple[float, float], sigma_px: float = 0.5
) -> Plane:
    """The plane of a rectangle, seen at its four corners (4, 2): upper left, upper right, lower
    right, lower left, of width and height size_mm. Its first corner is the plane's origin.
    """
    width = checked_length(size_mm[0], "the rectangle's width")
    height = checked_length(size_mm[1], "the rectangle's height")
    return plane_from_points(corners_px, rectangle_mm(width, height), sigma_px)


def rectangle_mm(width: float, height: float) -> Array:
    """Its corners (4, 2) from the upper left one on."""
    return np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])


def plane_from_points(
    points_px: npt.ArrayLike, points_mm: npt.ArrayLike, sigma_px: float = 0.5
) -> Plane:
    """The plane through four points or more (n, 2) px whose places (n, 2) mm in it are known."""
    px = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)
    mm = np.asarray(points_mm, dtype=np.float64).reshape(-1, 2)
    if len(px) != len(mm) or len(px) < 4:
        raise CalibrationError(
            f"{len(px)} points in the picture and {len(mm)} in the plane: four or more are needed,"
            " each in both"
        )
    check_corners(px)
    # Both sides centred and scaled (Hartley 1997), so that all nine numbers are about 1.
    T_px, T_mm = _scaling(px), _scaling(mm)
    image, world = project(T_px, px), project(T_mm, mm)
    H = _direct(image, world)

    def seen(h: Array) -> Array:
        return project(h.reshape(3, 3), world).reshape(-1)

    # Gauss-Newton in the eight directions that change the homography, not its scale.
    for _ in range(10):
        h = H.reshape(-1)
        free = np.linalg.svd(h[None])[2][1:].T  # (9, 8)
        J = jacobian(seen, h) @ free
        step = np.linalg.lstsq(J, image.reshape(-1) - seen(h), rcond=None)[0]
        H = (h + free @ step).reshape(3, 3)
        H /= np.linalg.norm(H)
        if np.abs(step).max() < 1e-12:
            break
    sigma = sigma_px * T_px[0, 0]
    spread = free @ inverted(J.T @ J / sigma**2) @ free.T
    back = np.kron(inverted(T_px), T_mm.T)  # row by row: A H B is (A x B^T) of H
    h = back @ H.reshape(-1)
    size = np.linalg.norm(h)
    # The plane lies before the camera.
    side = np.sign((homogeneous(mm) @ h[6:]).sum())
    return Plane(side * h.reshape(3, 3) / size, back @ spread @ back.T / size**2)


def plane_from_length(
    from_px: npt.ArrayLike, to_px: npt.ArrayLike, length_mm: float, sigma_px: float = 0.5
) -> Plane:
    """A plane that the camera looks at squarely, from one length in it: a plain scale, x and y as
    in the picture, and the length's start the origin.
    """
    length = checked_length(length_mm, "the reference")
    ends = _apart(from_px, to_px, sigma_px)

    def scaled(x: Array) -> Array:
        per_mm = np.hypot(*(x[2:] - x[:2])) / length
        H = np.array([[per_mm, 0.0, x[0]], [0.0, per_mm, x[1]], [0.0, 0.0, 1.0]])
        return (H / np.linalg.norm(H)).reshape(-1)

    H, spread = propagated(scaled, ends.reshape(-1), np.eye(4) * sigma_px**2)
    return Plane(H.reshape(3, 3), spread)


def plane_from_view(
    view: PlaneView,
    from_px: npt.ArrayLike,
    to_px: npt.ArrayLike,
    length_mm: float,
    sigma_px: float = 0.5,
) -> Plane:
    """A plane whose edges gave the view, and one known length in it, between two pixels (2,)."""
    length = checked_length(length_mm, "the reference")
    ends = _apart(from_px, to_px, sigma_px)

    def scaled(x: Array) -> Array:
        H = view.matrix(x[:6])
        mm = project(inverted(H), x[6:].reshape(2, 2))
        per_mm = np.hypot(*(mm[1] - mm[0])) / length
        H = H @ np.diag([per_mm, per_mm, 1.0])
        return (H / np.linalg.norm(H)).reshape(-1)

    covariance = np.zeros((10, 10))
    covariance[:6, :6] = view.covariance
    np.fill_diagonal(covariance[6:, 6:], sigma_px**2)
    H, spread = propagated(scaled, np.concatenate([np.zeros(6), ends.reshape(-1)]), covariance)
    return Plane(H.reshape(3, 3), spread)


def _apart(from_px: npt.ArrayLike, to_px: npt.ArrayLike, sigma_px: float) -> Array:
    """Both ends (2, 2); CalibrationError where they are one."""
    ends = np.stack([np.asarray(from_px), np.asarray(to_px)]).astype(np.float64)
    if not np.hypot(*(ends[1] - ends[0])) >= 2.0 * sigma_px:
        raise CalibrationError(
            "the reference's ends are the same point in the picture; give one at each end"
        )
    return ends


def _scaling(points: Array) -> Array:
    """Takes points (n, 2) to their middle and to size 1; (3, 3)."""
    middle, size = points.mean(axis=0), 1.0 / points.std()
    return np.array([[size, 0, -size * middle[0]], [0, size, -size * middle[1]], [0, 0, 1.0]])


def _direct(px: Array, mm: Array) -> Array:
    """Direct linear transformation of scaled points; (3, 3) of norm 1."""
    image, world = homogeneous(px), homogeneous(mm)
    zero = np.zeros_like(world)
    rows = np.concatenate(
        [
            np.hstack([world, zero, -image[:, :1] * world]),
            np.hstack([zero, world, -image[:, 1:2] * world]),
        ]
    )
    return np.linalg.svd(rows)[2][-1].reshape(3, 3)


def check_corners(px: Array) -> None:
    """CalibrationError where three of four corners, or all points, are in a line."""
    if not np.isfinite(px).all():
        raise CalibrationError("a corner's pixel is no number; give x,y of each in the picture")
    groups = [np.delete(np.arange(4), out) for out in range(4)] if len(px) == 4 else [...]
    for group in groups:
        spread = np.linalg.svd(px[group] - px[group].mean(axis=0), compute_uv=False)
        if spread[1] < _FLATTEST * max(spread[0], 1e-9):
            raise CalibrationError(
                f"points are in a line, or two are one ({_listed(px)}): the four corners of a"
                " rectangle are needed, in order around it"
            )
    if len(px) == 4:
        sides = np.roll(px, -1, axis=0) - px
        turns = sides[:, 0] * np.roll(sides[:, 1], -1) - sides[:, 1] * np.roll(sides[:, 0], -1)
        if np.ptp(np.sign(turns)) > 0:
            raise CalibrationError(
                f"the corners cross over ({_listed(px)}); give them in order around the rectangle:"
                " upper left, upper right, lower right, lower left"
            )


def _listed(px: Array) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in px)
