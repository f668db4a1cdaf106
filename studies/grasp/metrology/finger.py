"""A finger's joints in pixels of a plane that is known: angles and bones in mm, with sigmas.

What measuring a video calls where the picture has a reference: the joints' own noise and the
plane's uncertainty, which all pictures share, go into every sigma.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from studies.grasp.metrology.plane import Plane, project
from studies.grasp.metrology.segments import inverted
from studies.grasp.metrology.uncertainty import jacobian, sigma_steps


class FingerInPlane(NamedTuple):
    """n pictures. angles: MCP, PIP, DIP, positive where the finger turns from x to y as the
    plane's axes do; lengths: proximal, middle, distal; NaN where a joint is. plane_sigma: what of
    a sigma comes from the plane, and no averaging over pictures makes smaller.
    """

    angles_rad: Array  # (n, 3)
    angles_sigma_rad: Array  # (n, 3)
    lengths_mm: Array  # (n, 3)
    lengths_sigma_mm: Array  # (n, 3)
    plane_sigma: Array  # (n, 6): of angles, then lengths


class PointsInPlane(NamedTuple):
    """points (n, 2) mm; sigma (n,): of each coordinate, from the pixels' noise alone; shared (n,):
    from the plane's uncertainty.
    """

    points_mm: Array
    sigma_mm: Array
    shared_mm: Array


def points_in_plane(
    plane: Plane, points_px: npt.ArrayLike, sigma_px: npt.ArrayLike
) -> PointsInPlane:
    """Points (n, 2) px with their sigmas (n,), or one for all, in the plane."""
    px = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)
    sigma = np.broadcast_to(np.asarray(sigma_px, dtype=np.float64), len(px))
    by_pixel = _by_pixel(plane, px)  # (n, 2, 2)
    by_plane = _by_plane(plane, lambda back: project(back, px))  # (n, 2, 9)
    shared = np.einsum("nij,jk,nik->n", by_plane, plane.covariance, by_plane)
    return PointsInPlane(
        plane.to_mm(px),
        sigma * np.sqrt(0.5 * (by_pixel**2).sum(axis=(1, 2))),
        np.sqrt(np.maximum(0.5 * shared, 0.0)),
    )


def finger_in_plane(
    plane: Plane,
    places_px: npt.ArrayLike,
    sigma_px: npt.ArrayLike,
    *,
    base_to_mcp: bool = False,
) -> FingerInPlane:
    """Angles and bones of n pictures. places_px (n, 6, 2): two points of the base line, towards
    the finger, then MCP, PIP, DIP, tip, px of pictures without distortion; sigma_px (n, 6), or one
    for all. base_to_mcp: the base line's second point is the MCP joint, with the same error.
    """
    px = np.asarray(places_px, dtype=np.float64).reshape(-1, 6, 2)
    sigma = np.broadcast_to(np.asarray(sigma_px, dtype=np.float64), px.shape[:2])
    back = inverted(plane.image_from_plane)

    def measured(H_back: Array, px: Array = px) -> Array:
        return _angles_and_lengths(project(H_back, px.reshape(-1, 2)).reshape(-1, 6, 2))

    value = measured(back)  # (n, 6)
    by_plane = _by_plane(plane, measured)  # (n, 6, 9)
    shared = np.einsum("nij,jk,nik->ni", by_plane, plane.covariance, by_plane)

    def moved(step: Array) -> Array:
        return measured(back, px + step.reshape(6, 2))

    by_place = jacobian(moved, np.zeros(12)).reshape(-1, 6, 6, 2)
    if base_to_mcp:
        by_place[:, :, 2] += by_place[:, :, 1]
        by_place[:, :, 1] = 0.0
    own = (by_place**2 * (sigma**2)[:, None, :, None]).sum(axis=(2, 3))
    whole = np.sqrt(np.maximum(own + shared, 0.0))
    return FingerInPlane(
        value[:, :3], whole[:, :3], value[:, 3:], whole[:, 3:], np.sqrt(np.maximum(shared, 0.0))
    )


def _angles_and_lengths(places: Array) -> Array:
    """Of places (n, 6, 2) mm; (n, 6)."""
    steps = np.diff(places, axis=1)[:, [0, 2, 3, 4]]  # base, three bones
    x, y = steps[..., 0], steps[..., 1]
    sine = x[:, :-1] * y[:, 1:] - y[:, :-1] * x[:, 1:]
    cosine = x[:, :-1] * x[:, 1:] + y[:, :-1] * y[:, 1:]
    return np.concatenate([np.arctan2(sine, cosine), np.hypot(x, y)[:, 1:]], axis=1)


def _by_plane(plane: Plane, result: Callable[[Array], Array]) -> Array:
    """Derivatives of a result by the plane's nine numbers, in its last axis."""

    def whole(h: Array) -> Array:
        return result(inverted(h.reshape(3, 3)))

    steps = sigma_steps(plane.covariance)
    return jacobian(whole, plane.image_from_plane.reshape(-1), steps)


def _by_pixel(plane: Plane, px: Array) -> Array:
    """Derivatives (n, 2, 2) of mm by px."""
    back = inverted(plane.image_from_plane)
    return jacobian(lambda step: project(back, px + step), np.zeros(2))
