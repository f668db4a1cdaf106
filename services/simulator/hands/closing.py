"""How the digits of a hand close about a solid until their last bones touch it. Pure.

A finger bends at its knuckle as far as leaves its last bone to touch first, and then curls; the
thumb is set so that it presses against where the fingers do. All in the wrist frame, at build time:
a whole hand takes about 0.3 s.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.solids import SignedDistance, Solid, capsule_distance
from rhot.geometry.transforms import Array, apply, inverse, rotation_from_quaternion
from rhot.hand import Digit, HandModel

Flags = npt.NDArray[np.bool_]

# Steps of the search, along the first joint and along the next; a step of the curl is halved as
# often: 110 deg / 28 / 2^10 moves a tip by 0.3 um.
_STEPS, _CURLS, _HALVINGS = 16, 28, 10
# Of the thumb's abduction and of its first joint.
_THUMB_STEPS = (7, 11)
# Bones before the last one may come this much nearer than they should, on the way too.
_SLACK_M = 3e-4
# Instants of the way that are looked at.
_WAY = 25
# Thumbs tried for a free way, best first.
_TRIES = 12


class Closed(NamedTuple):
    """One digit at the end of its way; touching is false for one that does not get there."""

    angles_rad: Array  # (4,)
    touching: bool
    normal: Array  # (3,) of the solid where the last bone is nearest, in the wrist frame


class Reach(NamedTuple):
    """A digit before a solid: where its bones are, and how far from it.

    gap_m is the distance at which a bone counts as touching: slightly negative for a touch.
    """

    digit: Digit
    side: float
    solid: Solid
    T_object_from_wrist: Array  # (4, 4)
    gap_m: float

    def distances(self, angles_rad: Array) -> SignedDistance:
        """Of n poses (n, 4): of each of the three bones, distance_m (n * 3,) and so on."""
        ends, radii = bones(self.digit, self.side, angles_rad)
        ends = apply(self.T_object_from_wrist, ends.reshape(-1, 3)).reshape(-1, 2, 3)
        return capsule_distance(self.solid, ends, np.tile(radii, (len(angles_rad), 1)))

    def gaps(self, angles_rad: Array) -> Array:
        """Distances beyond gap_m of n poses (n, 4); (n, 3)."""
        return self.distances(angles_rad).distance_m.reshape(-1, 3) - self.gap_m

    def coupled(self, angles_rad: Array) -> Array:
        """Angles (n, 4) whose last one follows the one before, as in every gesture."""
        (_, high), (low_last, high_last) = self.digit.limits_rad[2], self.digit.limits_rad[3]
        ratio = min(self.digit.coupling, max(high_last, 0.0) / max(high, 1e-9))
        angles = angles_rad.copy()
        angles[:, 3] = np.clip(ratio * angles[:, 2], low_last, high_last)
        return angles

    def closed(self, angles_rad: Array, *, touching: bool) -> Closed:
        """The end of the way."""
        normal = self.T_object_from_wrist[:3, :3].T @ self.distances(angles_rad[None]).normal[2]
        return Closed(angles_rad, touching, normal)

    def way_is_free(self, start: Array, end: Array) -> bool:
        """Whether no bone comes too near on the straight way between two poses (4,)."""
        share = np.linspace(0.0, 1.0, _WAY)[:, None]
        return bool(np.all(self.gaps(start + share * (end - start)) > -_SLACK_M))


def bones(digit: Digit, side: float, angles_rad: Array) -> tuple[Array, Array]:
    """The three bones of a digit as capsules: ends (n, 3, 2, 3) in the wrist frame, radii (3, 2).

    angles_rad (n, 4). The same as services/simulator/hands/bodies.py draws.
    """
    count = len(angles_rad)
    rotation = np.broadcast_to(rotation_from_quaternion(digit.base_wxyz), (count, 3, 3))
    position = np.broadcast_to(np.array(digit.base_m), (count, 3))
    r0, r1, r2, r3 = digit.radii_m
    ends = np.empty((count, 3, 2, 3))
    for bone in range(3):
        about_y = side * angles_rad[:, 0] if bone == 0 else np.zeros(count)
        rotation = rotation @ _turns(about_y, angles_rad[:, bone + 1])
        ends[:, bone, 0] = position
        position = position - digit.lengths_m[bone] * rotation[:, :, 2]
        ends[:, bone, 1] = position
    ends[:, 2, 1] += min(r3, digit.lengths_m[2]) * rotation[:, :, 2]
    return ends, np.array([(r0, r1), (r1, r2), (r2, r3)])


def _turns(about_y: Array, flexion: Array) -> Array:
    """Ry(about_y) @ Rx(-flexion); (n, 3, 3)."""
    cy, sy, cx, sx = np.cos(about_y), np.sin(about_y), np.cos(flexion), np.sin(flexion)
    zero = np.zeros_like(cy)
    rows = [[cy, -sy * sx, sy * cx], [zero, cx, sx], [-sy, -cy * sx, cy * cx]]
    return np.moveaxis(np.array(rows), 2, 0)


def close_finger(reach: Reach, start_rad: Array, abduction_rad: float) -> Closed:
    """A finger about a solid, from start_rad (4,)."""
    bends = np.linspace(start_rad[1], reach.digit.limits_rad[1][1], _STEPS)
    poses = np.tile(start_rad, (_STEPS, 1))
    poses[:, 0], poses[:, 1] = abduction_rad, bends
    poses, touched = _curled(reach, poses)
    gaps = reach.gaps(poses)
    good = touched & (gaps[:, 0] > -_SLACK_M) & (gaps[:, 2] <= gaps[:, 1] + 1e-6)
    # Best is the one that lies against the solid with all its bones.
    for row in np.argsort(np.where(good, gaps[:, 0] + gaps[:, 1], np.inf)):
        if good[row] and reach.way_is_free(start_rad, poses[row]):
            return reach.closed(poses[row], touching=True)
    return _at_its_limit(reach, start_rad, poses)


def close_thumb(reach: Reach, start_rad: Array, against: Array) -> Closed:
    """A thumb against where the fingers press: the normal `against` (3,) of the solid there."""
    limits = reach.digit.limits_rad
    axes = [np.linspace(*limits[k], count) for k, count in enumerate(_THUMB_STEPS)]
    poses = np.tile(start_rad, (len(axes[0]) * len(axes[1]), 1))
    poses[:, :2] = list(product(*axes))
    poses[:, 2] = limits[2][0]
    poses, touched = _curled(reach, poses)
    found = reach.distances(poses)
    gaps = found.distance_m.reshape(-1, 3) - reach.gap_m
    good = touched & (gaps[:, 0] > -_SLACK_M) & (gaps[:, 2] <= gaps[:, 1] + 1e-6)
    normal = found.normal.reshape(-1, 3, 3)[:, 2] @ reach.T_object_from_wrist[:3, :3]
    order = np.argsort(np.where(good, normal @ against, np.inf))
    for row in order[:_TRIES]:
        if good[row] and reach.way_is_free(start_rad, poses[row]):
            return reach.closed(poses[row], touching=True)
    return _at_its_limit(reach, start_rad, poses)


def _curled(reach: Reach, poses: Array) -> tuple[Array, Flags]:
    """Poses (n, 4) curled at their third angle until a bone touches, and which of them do (n,)."""
    count = len(poses)
    curls = np.linspace(poses[:, 2], reach.digit.limits_rad[2][1], _CURLS)  # (curls, n)
    tried = np.tile(poses, (_CURLS, 1))
    tried[:, 2] = curls.ravel()
    gaps = reach.gaps(reach.coupled(tried)).reshape(_CURLS, count, 3)[..., 1:].min(axis=2)
    inside = gaps <= 0.0
    first = np.argmax(inside, axis=0)
    touched = inside.any(axis=0) & (first > 0)
    rows = np.arange(count)
    low, high = curls[np.maximum(first - 1, 0), rows], curls[first, rows]
    ends = poses.copy()
    for _ in range(_HALVINGS):
        ends[:, 2] = 0.5 * (low + high)
        within = reach.gaps(reach.coupled(ends))[:, 1:].min(axis=1) <= 0.0
        low, high = np.where(within, low, ends[:, 2]), np.where(within, ends[:, 2], high)
    ends[:, 2] = np.where(touched, low, np.where(inside.any(axis=0), poses[:, 2], curls[-1]))
    return reach.coupled(ends), touched


def _at_its_limit(reach: Reach, start_rad: Array, poses: Array) -> Closed:
    """What comes nearest without touching, if anything does."""
    gaps = reach.gaps(poses)
    free = np.all(gaps > -_SLACK_M, axis=1)
    for row in np.argsort(np.where(free, gaps[:, 2], np.inf))[:_TRIES]:
        if free[row] and reach.way_is_free(start_rad, poses[row]):
            return reach.closed(poses[row], touching=False)
    return reach.closed(start_rad, touching=False)


def reaches(
    model: HandModel, solid: Solid, T_wrist_from_object: Array, gap_m: float
) -> list[Reach]:
    """The five digits of a hand before a solid."""
    T_object_from_wrist = inverse(T_wrist_from_object)
    return [Reach(digit, model.side, solid, T_object_from_wrist, gap_m) for digit in model.digits]
