"""Vanishing points: where the images of parallel lines meet, at infinity where they stay parallel.

A vanishing point is a unit vector in homogeneous coordinates that are centred and scaled
(`Scale`), so that one at infinity is a vector like any other, and its covariance stays finite.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from studies.grasp.metrology.segments import homogeneous
from studies.grasp.metrology.uncertainty import jacobian

# Segments whose ends miss the line to the vanishing point by more sigmas belong to other
# directions; a normal error exceeds 3 once in 370.
_GATE = 3.0
# Pairs that are tried for a first guess: of 40 % outliers, 36 % of pairs are good, and none of 300
# would be with probability 1e-58.
_PAIRS = 300
_ROUNDS = 15


class Scale(NamedTuple):
    """Centred and scaled pixels: x_px = centre + size * x / w."""

    centre: tuple[float, float]
    size: float

    def from_pixels(self, points_px: npt.ArrayLike) -> Array:
        """(n, 2) px -> (n, 2)."""
        return (np.asarray(points_px, dtype=np.float64) - self.centre) / self.size

    @property
    def matrix(self) -> Array:
        """Takes scaled homogeneous coordinates to pixels; (3, 3)."""
        (x, y), size = self.centre, self.size
        return np.array([[size, 0.0, x], [0.0, size, y], [0.0, 0.0, 1.0]])


class VanishingPoint(NamedTuple):
    """direction: unit, scaled coordinates; covariance (3, 3) of it, of rank 2; inliers: which
    segments meet there.
    """

    direction: Array  # (3,)
    covariance: Array  # (3, 3)
    inliers: npt.NDArray[np.bool_]  # (n,)
    scale: Scale

    @property
    def pixel(self) -> Array:
        """In homogeneous pixels (3,); the last is 0 at infinity."""
        return self.scale.matrix @ self.direction

    def at_infinity(self, sigmas: float = 2.0) -> bool:
        """Whether it cannot be told from infinity."""
        return abs(self.direction[2]) <= sigmas * float(np.sqrt(self.covariance[2, 2]))


def scale_of(segments: Array) -> Scale:
    """A scale in which segments (n, 2, 2) are of size 1."""
    points = segments.reshape(-1, 2)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    size = max(float(np.abs(points - middle).max()), 1.0)
    return Scale((float(middle[0]), float(middle[1])), size)


def vanishing_point(
    segments: npt.ArrayLike, sigma_px: float = 0.5, seed: int = 0, scale: Scale | None = None
) -> VanishingPoint:
    """Where segments (n, 2, 2) in px meet, those left out that do not.

    The ends' distances from the line through a segment's middle and the point are minimised, in
    sigmas of the ends (Liebowitz 2001, section 3.4), with Huber's weights.
    """
    given = np.asarray(segments, dtype=np.float64).reshape(-1, 2, 2)
    if len(given) < 2:
        raise CalibrationError(
            f"a vanishing point needs 2 segments that are parallel in the world, and has"
            f" {len(given)}; give more edges of this direction"
        )
    scale = scale or scale_of(given)
    ends = scale.from_pixels(given)
    sigma = sigma_px / scale.size
    best = _first_guess(ends, sigma, np.random.default_rng(seed))
    for _ in range(_ROUNDS):
        off = _misses(ends, best) / sigma
        weight = np.where(np.abs(off) < _GATE, 1.0, 0.0)
        basis = _tangent(best)

        def miss(step: Array, at: Array = best, basis: Array = basis) -> Array:
            return _misses(ends, _unit(at + basis @ step)) / sigma

        J = jacobian(miss, np.zeros(2))
        information = (J * weight[:, None]).T @ J
        if np.linalg.eigvalsh(information)[0] < 1e-9:
            raise CalibrationError(
                "the segments lie on one line, and meet everywhere on it; give edges that are"
                " parallel but apart"
            )
        step = -np.linalg.solve(information, J.T @ (weight * off))
        best = _unit(best + basis @ step)
        if np.abs(step).max() < 1e-10:
            break
    inliers = np.abs(_misses(ends, best) / sigma) < _GATE
    covariance = basis @ np.linalg.inv(information) @ basis.T
    return VanishingPoint(best, covariance, inliers, scale)


def strongest(
    segments: npt.ArrayLike, number: int = 2, sigma_px: float = 0.7, seed: int = 0
) -> list[VanishingPoint]:
    """The directions that most of the length of detected segments (n, 2, 2) has, one after the
    other; each one's inliers are of all segments.
    """
    given = np.asarray(segments, dtype=np.float64).reshape(-1, 2, 2)
    left = np.ones(len(given), dtype=bool)
    found: list[VanishingPoint] = []
    scale = scale_of(given) if len(given) else None
    for _ in range(number):
        if left.sum() < 3:
            break
        one = vanishing_point(given[left], sigma_px, seed, scale)
        mine = np.zeros(len(given), dtype=bool)
        mine[np.flatnonzero(left)[one.inliers]] = True
        found.append(one._replace(inliers=mine))
        left &= ~mine
    return found


def vanishing_line(u: VanishingPoint, v: VanishingPoint) -> tuple[Array, Array]:
    """Of the plane of two directions: the line (3,) in homogeneous pixels, unit, and its
    covariance (3, 3).
    """

    def line(both: Array) -> Array:
        return _unit(np.cross(u.scale.matrix @ both[:3], v.scale.matrix @ both[3:]))

    both = np.concatenate([u.direction, v.direction])
    covariance = np.zeros((6, 6))
    covariance[:3, :3], covariance[3:, 3:] = u.covariance, v.covariance
    J = jacobian(line, both)
    if np.linalg.norm(np.cross(u.pixel, v.pixel)) < 1e-12:
        raise CalibrationError(
            "both vanishing points are the same; give edges of two directions of the plane"
        )
    return line(both), J @ covariance @ J.T


def _misses(ends: Array, point: Array) -> Array:
    """How far each segment's ends are from the line through its middle and the point; (n,)."""
    middle = ends.mean(axis=1)
    line = np.cross(homogeneous(middle), point)
    size = np.maximum(np.hypot(line[:, 0], line[:, 1]), 1e-12)
    # Both ends are off by the same, to opposite sides: sqrt(2) makes one residual of two.
    return np.sqrt(2.0) * (line * homogeneous(ends[:, 0])).sum(axis=1) / size


def _first_guess(ends: Array, sigma: float, rng: np.random.Generator) -> Array:
    """The crossing of two segments that most of the others' length goes through; (3,)."""
    lines = np.cross(homogeneous(ends[:, 0]), homogeneous(ends[:, 1]))
    lines /= np.maximum(np.linalg.norm(lines[:, :2], axis=1, keepdims=True), 1e-12)
    first, second = np.triu_indices(len(ends), 1)
    if len(first) > _PAIRS:
        chosen = rng.choice(len(first), _PAIRS, replace=False)
        first, second = first[chosen], second[chosen]
    crossings = np.cross(lines[first], lines[second])
    sizes = np.linalg.norm(crossings, axis=1)
    if not (sizes > 1e-9).any():
        raise CalibrationError(
            "the segments lie on one line, and meet everywhere on it; give edges that are parallel"
            " but apart"
        )
    lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    best, most = crossings[0], -1.0
    for crossing, size in zip(crossings, sizes, strict=True):
        if size > 1e-9:
            # A crossing in the midst of a segment is a corner, not a direction; its length counts
            # by how well it fits.
            off = _misses(ends, crossing / size) / sigma
            support = float((lengths * np.exp(-0.5 * np.minimum(off, 6.0) ** 2)).sum())
            if support > most:
                best, most = crossing / size, support
    return best


def _tangent(direction: Array) -> Array:
    """Two directions (3, 2) about a unit vector."""
    return np.linalg.svd(direction[None])[2][1:].T


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)
