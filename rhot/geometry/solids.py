"""Solids: how far points are from an object's surface, and the nearest point of it.

All in the object's own frame, metres; the origin is the middle. Distances are signed: negative
inside. A Box, a Cylinder (axis y) and a Sphere are exact; a mesh is rhot/geometry/meshes.py, and
rhot/files/shapes.py makes what rig.toml says. Pure; input that is not finite is the caller's error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from rhot.geometry.transforms import Array

# Balls tried along a capsule, and again, closer, about the nearest of them: how far to each side,
# as shares of the capsule. Of 4000 of a hand's bones (20 and 70 mm) at random about a box of 60 mm,
# whose edges are worst, the distance is found to 1 and 4 um, where they overlap by 5 mm at most.
_BALLS = 9
_STEPS = (1 / 8, 1 / 32, 0.0)
# A shorter vector has no direction: its square has no digits left.
_NOTHING = 1e-100


class SignedDistance(NamedTuple):
    """Of n points: distance to the surface, its nearest point, and where it faces there.

    normal is the gradient of the distance: out of the solid.
    """

    distance_m: Array  # (n,)
    point_m: Array  # (n, 3)
    normal: Array  # (n, 3)


class Solid(Protocol):
    """Something with a surface.

    signed is False for a surface without an inside (a mesh with holes): its distances are never
    negative, its normals face the point. reach_m is the radius of a ball about the origin that
    holds all of it.
    """

    @property
    def signed(self) -> bool: ...

    @property
    def reach_m(self) -> float: ...

    def distance(self, points_m: Array) -> SignedDistance:
        """Of points (n, 3) in the object's frame."""
        ...


@dataclass(frozen=True)
class Box:
    """Edges along the axes."""

    size_m: tuple[float, float, float]

    @property
    def signed(self) -> bool:
        """Always."""
        return True

    @property
    def reach_m(self) -> float:
        """Half the diagonal."""
        return 0.5 * float(np.linalg.norm(self.size_m))

    def distance(self, points_m: Array) -> SignedDistance:
        """Of points (n, 3)."""
        return _block(np.asarray(points_m, dtype=np.float64), 0.5 * np.array(self.size_m))


@dataclass(frozen=True)
class Cylinder:
    """Axis y, closed by two discs."""

    diameter_m: float
    height_m: float

    @property
    def signed(self) -> bool:
        """Always."""
        return True

    @property
    def reach_m(self) -> float:
        """From the middle to a rim."""
        return 0.5 * float(np.hypot(self.diameter_m, self.height_m))

    def distance(self, points_m: Array) -> SignedDistance:
        """Of points (n, 3): those of a rectangle, in the half plane of the axis and the point."""
        x, y, z = np.asarray(points_m, dtype=np.float64).T
        radius = np.hypot(x, z)
        # On the axis itself every direction is as good.
        beside = radius > _NOTHING
        safe = np.where(beside, radius, 1.0)
        across = np.where(beside, x / safe, 1.0), np.where(beside, z / safe, 0.0)
        half = 0.5 * np.array([self.diameter_m, self.height_m])
        flat = _block(np.stack([radius, y], axis=1), half)
        return SignedDistance(
            flat.distance_m, _turned(flat.point_m, across), _turned(flat.normal, across)
        )


@dataclass(frozen=True)
class Sphere:
    """A ball."""

    diameter_m: float

    @property
    def signed(self) -> bool:
        """Always."""
        return True

    @property
    def reach_m(self) -> float:
        """Its radius."""
        return 0.5 * self.diameter_m

    def distance(self, points_m: Array) -> SignedDistance:
        """Of points (n, 3)."""
        points = np.asarray(points_m, dtype=np.float64)
        length = np.linalg.norm(points, axis=1)[:, None]
        beside = length > _NOTHING
        safe = np.where(beside, length, 1.0)
        normal = np.where(beside, points / safe, [0.0, 1.0, 0.0])
        return SignedDistance(length[:, 0] - self.reach_m, self.reach_m * normal, normal)


def capsule_distance(solid: Solid, ends_m: Array, radii_m: Array) -> SignedDistance:
    """From the skin of c tapered capsules to a solid: each the balls between two end balls.

    ends_m (c, 2, 3) in the object's frame, radii_m (c, 2). point_m and normal are the solid's,
    where it is nearest to the skin.
    """
    rows = np.arange(len(ends_m))
    share = np.broadcast_to(np.linspace(0.0, 1.0, _BALLS), (len(ends_m), _BALLS))
    for step in _STEPS:
        centres = ends_m[:, None, 0] + share[..., None] * (ends_m[:, 1] - ends_m[:, 0])[:, None]
        radius = radii_m[:, :1] + share * (radii_m[:, 1:] - radii_m[:, :1])  # (c, balls)
        found = solid.distance(centres.reshape(-1, 3))
        gap = found.distance_m.reshape(radius.shape) - radius
        best = np.argmin(gap, axis=1)
        if step:
            about = share[rows, best, None] + np.linspace(-step, step, _BALLS)
            share = np.clip(about, 0.0, 1.0)
    chosen = rows * _BALLS + best
    return SignedDistance(gap[rows, best], found.point_m[chosen], found.normal[chosen])


def _block(points: Array, half: Array) -> SignedDistance:
    """A box of k dimensions about the origin: points (n, k), half its edges (k,)."""
    side = np.where(points < 0.0, -1.0, 1.0)
    beyond = np.abs(points) - half  # (n, k)
    out = np.maximum(beyond, 0.0)
    length = np.linalg.norm(out, axis=1)[:, None]
    outside = length > 0.0
    # Inside, and on the surface itself, the nearest face counts.
    facing = np.eye(len(half))[np.argmax(beyond, axis=1)]  # (n, k)
    normal = np.where(outside, out / np.where(outside, length, 1.0), facing)
    within = np.where(facing > 0.0, side * half, points)
    return SignedDistance(
        np.where(outside[:, 0], length[:, 0], beyond.max(axis=1)),
        np.where(outside, np.clip(points, -half, half), within),
        side * normal,
    )


def _turned(flat: Array, across: tuple[Array, Array]) -> Array:
    """Vectors (n, 2), away from the axis and along it, in space; (n, 3)."""
    x, z = across
    return np.stack([flat[:, 0] * x, flat[:, 1], flat[:, 0] * z], axis=1)
