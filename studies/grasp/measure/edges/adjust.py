"""All pictures of a finger together: its silhouette and the pose of each, by least squares. Pure.

A bundle adjustment in the plane. One picture does not say where in the finger a joint is; how the
outline and the skin move as the joint bends does. Unknowns: each picture's pose (6), and once the
distances of the outline, two bones' lengths, how flesh moves beside each joint, and where skin lies
on its bone. Measured: edges near the outline (weights of Tukey in limits that narrow), the moves
that skin shows from picture to picture, where it is against the mean of all pictures (patches.py),
the clicks of the first picture. Beforehand: sides are about as far from a joint, outlines smooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from studies.grasp.measure.edges.contrast import tukey
from studies.grasp.measure.edges.equations import System
from studies.grasp.measure.edges.follow import EDGE_INFORMATION, Followed
from studies.grasp.measure.edges.segments import Array
from studies.grasp.measure.edges.silhouette import (
    BONES,
    POSE,
    SEGMENTS,
    Silhouette,
    carried,
    joints_at,
    lay,
    normals_of,
    shown,
)
from studies.grasp.measure.edges.skin.patches import Placed

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
# Skin in a picture against that of all: px along the bone, across it, rad; where it lies on it.
# From the truth on what is fine in it errs by 0.1 to 0.35 px, 0.1 to 0.4 px, 0.2 to 1.2 deg RMS,
# part of it alike from picture to picture: NEES 0.2 to 1.1 at PIP and DIP. With 3 px and 5 deg PIP
# is 0.7 in place of 0.5 deg, DIP 2.0 in place of 1.9 (subjects 1, 3 and three people more).
_SKIN_SIGMA = np.array([0.4, 0.9, np.radians(1.5)])
_SKIN_LIMIT = 5.0
_OFFSET_SIGMA = np.array([4.0, 4.0, 0.1])
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


def adjust(
    first: Silhouette,
    followed: Sequence[Followed],
    clicks: Clicks,
    skin: Placed | None = None,
    start: Adjusted | None = None,
) -> Adjusted:
    """The silhouette and all poses that the pictures show together.

    skin: where each segment's skin was found from a start, which was adjusted without it.
    """
    poses = np.stack([one.vector for one in followed]) if start is None else start.poses
    shape = first if start is None else start.shape
    offsets = np.zeros((SEGMENTS, 3))
    nodes = len(shape.distances)
    many = max(1.0, len(followed) / _ALIKE)
    for limit in _LIMITS_PX:
        system = _system(shape, first, poses, followed, clicks, limit, many)
        _skin(system, shape, poses, skin, offsets)
        step, change, _, _ = system.solved()
        poses = poses + np.clip(step, -_LARGEST, _LARGEST)
        bones = np.append(change[nodes : nodes + BONES], 0.0)
        shape = shape.changed(
            shape.distances + change[:nodes],
            shape.lengths + bones,
            shape.flesh + change[nodes + BONES : len(change) - offsets.size],
        )
        offsets = offsets + change[-offsets.size :].reshape(offsets.shape)
    system = _system(shape, first, poses, followed, clicks, _LIMITS_PX[-1], many)
    _skin(system, shape, poses, skin, offsets)
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
) -> System:
    terms = len(shape.distances) + BONES + len(shape.flesh) + 3 * SEGMENTS
    system = System(len(followed), terms)
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


def _skin(
    system: System, shape: Silhouette, poses: Array, skin: Placed | None, offsets: Array
) -> None:
    """Skin moves as its bone does; where it lies on it (4, 3) px and rad is found with the rest."""
    terms = len(system.shape_right)
    for number, sigma in enumerate(np.tile(_OFFSET_SIGMA, SEGMENTS)):
        row = np.zeros(terms)
        row[terms - offsets.size + number] = 1.0
        system.know(row, -float(offsets.ravel()[number]), float(sigma))
    if skin is None:
        return
    local = skin.centres + offsets[:, :2]
    segments = np.arange(SEGMENTS)
    for picture, pose in enumerate(poses):
        points, derivative = carried(pose, shape.lengths, segments, local)
        joints = joints_at(pose, shape.lengths)
        for segment in np.flatnonzero(skin.weights[picture]):
            c, s = np.cos(pose[2 + segment]), np.sin(pose[2 + segment])
            axes = np.array([[c, s], [-s, c]])
            by_pose, by_shape = np.zeros((3, POSE)), np.zeros((3, terms))
            by_pose[:2] = axes @ derivative[segment]
            by_pose[2, 2 + segment] = 1.0
            for bone in range(int(np.clip(segment - 1, 0, BONES))):
                step = joints[bone + 1] - joints[bone]
                by_shape[:2, len(shape.distances) + bone] = axes @ step / shape.lengths[bone]
            at = terms - offsets.size + 3 * segment
            by_shape[:, at : at + 3] = np.eye(3)
            found = skin.poses[picture, segment]
            turn = found[2] - pose[2 + segment] - offsets[segment, 2]
            miss = np.array([*(axes @ (found[:2] - points[segment])), turn])
            weights = skin.weights[picture, segment] * tukey(miss / _SKIN_SIGMA, _SKIN_LIMIT)
            weights = weights / _SKIN_SIGMA**2
            system.add(picture, by_pose, by_shape, weights, weights * miss)


def _click(system: System, shape: Silhouette, pose: Array, clicks: Clicks, many: float) -> None:
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


def _beforehand(system: System, shape: Silhouette, first: Silhouette, many: float) -> None:
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


def _covariances(system: System, many: float) -> Array:
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
