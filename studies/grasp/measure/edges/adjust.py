"""All pictures of a finger together: its silhouette and the pose of each, by least squares. Pure.

A bundle adjustment in the plane. One picture does not say where in the finger a joint is; how the
outline moves as the joint bends does. Unknowns: each picture's pose (6), and once the distances of
the outline, two bones' lengths, and how flesh moves beside each joint. Measured: edges near the
outline (weights of Tukey in limits that narrow), the moves that skin shows from picture to picture,
the clicks of the first picture. Beforehand: sides are about as far from a joint, outlines smooth.

Pictures form a chain, so that their equations are banded; the shape's border is solved after it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from studies.grasp.measure.edges.contrast import tukey
from studies.grasp.measure.edges.follow import EDGE_INFORMATION, Followed
from studies.grasp.measure.edges.segments import Array
from studies.grasp.measure.edges.silhouette import (
    BONES,
    POSE,
    SEGMENTS,
    Silhouette,
    joints_at,
    lay,
    normals_of,
    shown,
)

_LIMITS_PX = (5.0, 4.0, 4.0, 3.0, 3.0, 2.5, 2.5, 2.5)
# Pictures after each other err alike: so many count as one beside what is known beforehand.
_ALIKE = 8.0
# A click; a move of the skin from picture to picture (px, rad).
_CLICK_PX = 1.5
_MOVE_SIGMA = np.array([0.7, 0.7, *np.radians((0.7, 0.7, 0.7, 0.7))])
# Beforehand, standard deviations in px: of a distance from where the first picture has it; of a
# side's bend from node to node; of the difference of both sides at a joint; of that of both halves
# of the fingertip; flesh, px a rad.
_DISTANCE_PX, _BEND_PX, _SIDES_PX, _TIP_PX, _FLESH_PX = 4.0, 1.5, 1.0, 1.5, 3.0
_LARGEST = np.array([6.0, 6.0, 0.3, 0.3, 0.3, 0.3])


class Clicks(NamedTuple):
    """joints (4, 2) px; base (2, 2): two points of the base line, None where none was clicked."""

    joints: Array
    base: Array | None

    @property
    def through(self) -> bool:
        """Whether the base line was clicked through the MCP joint: then it goes through it."""
        if self.base is None:
            return False
        (x, y), offset = self.base[1] - self.base[0], self.joints[0] - self.base[0]
        return abs(x * offset[1] - y * offset[0]) <= _CLICK_PX * float(np.hypot(x, y))


class Adjusted(NamedTuple):
    """shape; poses (f, 6); covariance (f, 6, 6) of each; of each picture how much of the outline's
    sides is supported by edges, (f, 4, 2): segments, sides of the back and the palm.
    """

    shape: Silhouette
    poses: Array
    covariances: Array
    support: Array


class _System:
    """Normal equations: a banded part for the poses, a border and a block for the shape."""

    def __init__(self, pictures: int, terms: int) -> None:
        self.band = np.zeros((2 * POSE, POSE * pictures))
        self.band[0] = 1e-6
        self.border = np.zeros((POSE * pictures, terms))
        self.right = np.zeros(POSE * pictures)
        self.shape = np.zeros((terms, terms))
        self.shape_right = np.zeros(terms)

    def add(
        self, picture: int, by_pose: Array, by_shape: Array, weights: Array, pull: Array
    ) -> None:
        """Residuals of one picture: rows (n, 6), (n, terms), weights (n,), weight * miss (n,)."""
        own = slice(POSE * picture, POSE * (picture + 1))
        block = by_pose.T @ (weights[:, None] * by_pose)
        for below in range(POSE):
            self.band[below, own.start : own.stop - below] += np.diagonal(block, -below)
        weighted = weights[:, None] * by_shape
        self.border[own] += by_pose.T @ weighted
        self.shape += by_shape.T @ weighted
        self.right[own] += by_pose.T @ pull
        self.shape_right += by_shape.T @ pull

    def link(self, picture: int, miss: Array, information: Array) -> None:
        """The move (6,) from the picture before: what it lacks, and its information (6,)."""
        at = POSE * picture
        self.band[0, at : at + POSE] += information
        self.band[0, at - POSE : at] += information
        self.band[POSE, at - POSE : at] -= information
        self.right[at : at + POSE] += information * miss
        self.right[at - POSE : at] -= information * miss

    def know(self, row: Array, miss: float, sigma: float) -> None:
        """Something about the shape alone."""
        self.shape += np.outer(row, row) / sigma**2
        self.shape_right += row * (miss / sigma**2)

    def solved(self) -> tuple[Array, Array, Array, Array]:
        """Steps of poses (f, 6) and shape, the shape's covariance, poses by shape (6 f, terms)."""
        # Not above: scipy takes longer to import than most commands take to run.
        from scipy.linalg import solveh_banded

        solved = solveh_banded(self.band, np.c_[self.border, self.right], lower=True)
        by_shape, alone = solved[:, :-1], solved[:, -1]
        covariance = np.linalg.inv(self.shape - self.border.T @ by_shape)
        step = covariance @ (self.shape_right - self.border.T @ alone)
        return (alone - by_shape @ step).reshape(-1, POSE), step, covariance, by_shape


def adjust(shape: Silhouette, followed: Sequence[Followed], clicks: Clicks) -> Adjusted:
    """The silhouette and all poses that the pictures show together."""
    poses = np.stack([one.vector for one in followed])
    first = shape
    nodes = len(shape.distances)
    many = max(1.0, len(followed) / _ALIKE)
    for limit in _LIMITS_PX:
        system = _system(shape, first, poses, followed, clicks, limit, many)
        step, change, _, _ = system.solved()
        poses = poses + np.clip(step, -_LARGEST, _LARGEST)
        bones = np.append(change[nodes : nodes + BONES], 0.0)
        shape = shape.changed(
            shape.distances + change[:nodes],
            shape.lengths + bones,
            shape.flesh + change[nodes + BONES :],
        )
    system = _system(shape, first, poses, followed, clicks, _LIMITS_PX[-1], many)
    return Adjusted(
        shape, poses, _covariances(system, many), _support(shape, poses, followed, _LIMITS_PX[-1])
    )


def _system(
    shape: Silhouette,
    first: Silhouette,
    poses: Array,
    followed: Sequence[Followed],
    clicks: Clicks,
    limit: float,
    many: float,
) -> _System:
    terms = len(shape.distances) + BONES + len(shape.flesh)
    system = _System(len(followed), terms)
    normals = normals_of(shape)
    for picture, (pose, one) in enumerate(zip(poses, followed, strict=True)):
        laid = lay(shape, normals, pose)
        miss = np.einsum("ncj,nj->nc", one.edges - laid.points[:, None], laid.normals)
        weights = one.weights * tukey(miss, limit) * EDGE_INFORMATION
        # What was clicked in the first picture holds for all, so its edges count as theirs do.
        weights *= (shown(shape, pose) * (many if picture == 0 else 1.0))[:, None]
        pull = (weights * miss).sum(axis=1)
        system.add(picture, laid.by_pose, laid.by_shape, weights.sum(axis=1), pull)
        if one.move is not None:
            lacks = one.move - (pose - poses[picture - 1])
            system.link(picture, lacks, _MOVE_SIGMA**-2.0)
        if (0, -1) not in shape.sides and (0, 1) not in shape.sides:
            # No back of the hand: its direction is held.
            row = np.eye(POSE)[2:3]
            system.add(picture, row, np.zeros((1, terms)), np.full(1, 1e8), np.zeros(1))
    _click(system, shape, poses[0], clicks, many)
    _beforehand(system, shape, first, many)
    return system


def _click(system: _System, shape: Silhouette, pose: Array, clicks: Clicks, many: float) -> None:
    """The clicked joints, and that the base line runs through its clicked point."""
    nodes, terms = len(shape.distances), len(system.shape_right)
    joints = joints_at(pose, shape.lengths)
    units = np.stack([np.cos(pose[2:]), np.sin(pose[2:])], axis=1)
    across = np.stack([-units[:, 1], units[:, 0]], axis=1)
    weight = np.full(2, many / _CLICK_PX**2)
    for number, (joint, click) in enumerate(zip(joints, clicks.joints, strict=True)):
        by_pose, by_shape = np.zeros((2, POSE)), np.zeros((2, terms))
        by_pose[:, :2] = np.eye(2)
        for bone in range(number):
            by_pose[:, 3 + bone] = shape.lengths[bone] * across[1 + bone]
            if bone < BONES:
                by_shape[:, nodes + bone] = units[1 + bone]
        system.add(0, by_pose, by_shape, weight, weight * (click - joint))
    if clicks.base is not None:
        start, end = clicks.base
        row, across_0 = np.zeros((1, POSE)), across[0]
        if clicks.through:
            row[0, :2], end = across_0, joints[0]
        row[0, 2] = -float((end - start) @ units[0])
        miss = np.array([(start - end) @ across_0])
        system.add(0, row, np.zeros((1, terms)), weight[:1], weight[:1] * miss)


def _beforehand(system: _System, shape: Silhouette, first: Silhouette, many: float) -> None:
    count, terms = len(shape.distances), len(system.shape_right)
    spread = 1.0 / np.sqrt(many)

    def know(factors: dict[int, float], sigma: float, goal: float = 0.0) -> None:
        row = np.zeros(terms)
        row[list(factors)] = list(factors.values())
        now = sum(factor * shape.distances[node] for node, factor in factors.items())
        system.know(row, goal - now, sigma * spread)

    for node in range(count):
        know({node: 1.0}, _DISTANCE_PX, float(first.distances[node]))
    for nodes in shape.sides.values():
        for a, b, c in zip(nodes, nodes[1:], nodes[2:], strict=False):
            know({a: 1.0, b: -2.0, c: 1.0}, _BEND_PX)
    for segment, end in ((1, -1), (2, 0), (2, -1), (3, 0), (3, -1)):
        pair = (shape.sides[segment, -1][end], shape.sides[segment, 1][end])
        know({pair[0]: 1.0, pair[1]: -1.0}, _SIDES_PX)
    for one, other in zip(shape.cap, reversed(shape.cap), strict=True):
        if one < other:
            know({one: 1.0, other: -1.0}, _TIP_PX)
    for number, flesh in enumerate(shape.flesh):
        row = np.zeros(terms)
        row[count + BONES + number] = 1.0
        system.know(row, -float(flesh), _FLESH_PX * spread)


def _covariances(system: _System, many: float) -> Array:
    """Of each pose (f, 6, 6): its own, and what the shape's adds."""
    _, _, shape, by_shape = system.solved()
    found = np.empty((len(system.right) // POSE, POSE, POSE))
    for picture in range(len(found)):
        own = slice(POSE * picture, POSE * (picture + 1))
        block = np.zeros((POSE, POSE))
        for below in range(POSE):
            rows = np.arange(POSE - below)
            block[rows + below, rows] = system.band[below, own.start : own.stop - below]
            block[rows, rows + below] = block[rows + below, rows]
        alone = np.linalg.inv(block)
        shared = by_shape[own] @ (many * shape) @ by_shape[own].T
        found[picture] = alone + shared
    return found


def _support(shape: Silhouette, poses: Array, followed: Sequence[Followed], limit: float) -> Array:
    """How much of each side is where edges are, (f, 4, 2), 0..1; folded away counts as unseen."""
    normals, samples = normals_of(shape), shape.samples
    found = np.zeros((len(followed), SEGMENTS, 2))
    for picture, (pose, one) in enumerate(zip(poses, followed, strict=True)):
        laid = lay(shape, normals, pose)
        miss = np.einsum("ncj,nj->nc", one.edges - laid.points[:, None], laid.normals)
        best = (np.minimum(3.0 * one.weights, 1.0) * (np.abs(miss) < limit)).max(axis=1)
        best *= shown(shape, pose) > 0.0
        for segment, side in shape.sides:
            own = (samples.segment == segment) & (samples.side == side)
            found[picture, segment, int(side == shape.palm)] = best[own].mean()
    return found
