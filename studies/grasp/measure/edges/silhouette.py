"""A finger's silhouette laid into a picture: where it is, and how that moves with pose and shape.
Pure.

Segments 0 to 3: back of the hand, proximal, middle, distal phalanx. Each has a frame of its own,
x along the bone, y to its right on the screen; that of the back of the hand starts at the MCP
joint, those of the phalanges at the joint before them. A sample is a point of the outline: origin
on the bone, direction to the skin, distance to it. Distances stand at nodes, between which they are
interpolated, and change beside a joint as it bends: flesh bulges, knuckles flatten.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from studies.grasp.measure.edges.segments import Array

SEGMENTS, POSE, BONES = 4, 6, 2
# Beside a joint, flesh moves along this share of a bone, most at the joint.
_FLESH_SHARE = 0.45
# An outline within this share of a bone from a joint is trusted less: folds, swellings; at the
# joint half as much (chosen on subjects 1, 3, 5: 0.5 to 2 times that differ by 0.2 deg at most).
_JOINT_SHARE = 0.35
# Where a joint folds, its palmar outline is hidden so much further than two straight bones hide it.
_FOLD_PX = 2.0


class Pose(NamedTuple):
    """The MCP joint (2,) px and the four segments' directions (4,) rad, as one vector (6,)."""

    vector: Array

    @property
    def turns(self) -> Array:
        return self.vector[2:]


@dataclass(frozen=True)
class Samples:
    """n samples of the outline. segment (n,); side (n,) -1, +1 or 0 (fingertip); origin, direction
    (n, 2) in the segment's frame; nodes (n, 2) and shares (n, 2): which distances, how much of
    each; flesh (n, m): how much of each of m flesh terms; trust (n,) 0..1.
    """

    segment: np.ndarray
    side: np.ndarray
    origin: Array
    direction: Array
    nodes: np.ndarray
    shares: Array
    flesh: Array
    trust: Array


@dataclass(frozen=True)
class Silhouette:
    """samples; distances (k,) px at the nodes; lengths (3,) of the bones and of the base line, px;
    flesh (m,) px a rad, of joints (m,) 1..3; bends (4,) rad at which flesh is at rest.

    sides: of each side of each segment (segment, side) its nodes, in their order; palm: +1 where
    flexion turns clockwise.
    """

    samples: Samples
    distances: Array
    lengths: Array
    base: float
    flesh: Array
    flesh_joints: np.ndarray
    bends: Array
    sides: dict[tuple[int, int], list[int]]
    cap: list[int]
    palm: int

    def changed(self, distances: Array, lengths: Array, flesh: Array) -> Silhouette:
        return replace(self, distances=distances, lengths=lengths, flesh=flesh)


class Laid(NamedTuple):
    """In the picture: points, outward normals (n, 2); derivatives of each point along its normal
    by pose (n, 6) and by shape (n, k + 2 + m): distances, the first two bones, flesh.
    """

    points: Array
    normals: Array
    by_pose: Array
    by_shape: Array


def joints_at(vector: Array, lengths: Array) -> Array:
    """MCP, PIP, DIP, tip; (4, 2) px."""
    turns = vector[3:]
    steps = lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return vector[:2] + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def carried(vector: Array, lengths: Array, segment: np.ndarray, local: Array) -> tuple:
    """Points (n, 2) of segments' frames in the picture, and their derivatives (n, 2, 6)."""
    joints = joints_at(vector, lengths)
    turned = _turned(vector, segment, local)
    derivative = np.zeros((len(local), 2, POSE))
    derivative[:, 0, 0] = derivative[:, 1, 1] = 1.0
    rows = np.arange(len(local))
    derivative[rows, :, 2 + segment] = np.stack([-turned[:, 1], turned[:, 0]], axis=1)
    for bone in (1, 2):
        turn = vector[2 + bone]
        across = lengths[bone - 1] * np.array([-np.sin(turn), np.cos(turn)])
        derivative[segment > bone, :, 2 + bone] = across
    return joints[np.maximum(segment - 1, 0)] + turned, derivative


def _turned(vector: Array, segment: np.ndarray, local: Array) -> Array:
    c, s = np.cos(vector[2:])[segment], np.sin(vector[2:])[segment]
    return np.stack([c * local[:, 0] - s * local[:, 1], s * local[:, 0] + c * local[:, 1]], axis=1)


def bends_of(vector: Array) -> Array:
    """How far each joint is bent, (4,); the first has no meaning."""
    return np.concatenate([np.zeros(1), np.diff(vector[2:])])


def flesh_terms(shape: Silhouette, vector: Array) -> Array:
    """How much of each flesh term every sample has at a pose, (n, m) rad."""
    return shape.samples.flesh * (bends_of(vector) - shape.bends)[shape.flesh_joints]


def outline_of(shape: Silhouette, vector: Array) -> Array:
    """Samples in their segments' frames at a pose, (n, 2)."""
    samples = shape.samples
    reach = (samples.shares * shape.distances[samples.nodes]).sum(axis=1)
    reach = reach + flesh_terms(shape, vector) @ shape.flesh
    return samples.origin + reach[:, None] * samples.direction


def normals_of(shape: Silhouette) -> Array:
    """Outward normals (n, 2) in the segments' frames, of the outline at rest."""
    samples = shape.samples
    reach = (samples.shares * shape.distances[samples.nodes]).sum(axis=1)
    local = samples.origin + reach[:, None] * samples.direction
    normals = samples.direction.copy()
    for segment, side in [*shape.sides, (SEGMENTS - 1, 0)]:
        own = np.flatnonzero((samples.segment == segment) & (samples.side == side))
        along = np.gradient(local[own], axis=0)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        normal /= np.maximum(np.hypot(*normal.T), 1e-9)[:, None]
        outward = np.sign((normal * samples.direction[own]).sum(axis=1))
        normals[own] = normal * outward[:, None]
    return normals


def lay(shape: Silhouette, normals: Array, vector: Array) -> Laid:
    """The outline at a pose (6,); normals as normals_of has them."""
    samples = shape.samples
    local = outline_of(shape, vector)
    points, derivative = carried(vector, shape.lengths, samples.segment, local)
    outward = _turned(vector, samples.segment, normals)
    along = (normals * samples.direction).sum(axis=1)
    rows = np.arange(len(local))
    nodes = len(shape.distances)
    by_shape = np.zeros((len(local), nodes + BONES + len(shape.flesh)))
    for column in (0, 1):
        by_shape[rows, samples.nodes[:, column]] += samples.shares[:, column] * along
    for bone in (1, 2):
        turn = vector[2 + bone]
        later = samples.segment > bone
        by_shape[later, nodes + bone - 1] = outward[later] @ np.array([np.cos(turn), np.sin(turn)])
    by_shape[:, nodes + BONES :] = flesh_terms(shape, vector) * along[:, None]
    by_pose = np.einsum("ni,nij->nj", outward, derivative)
    return Laid(points, outward, by_pose, by_shape)


def shown(shape: Silhouette, vector: Array) -> Array:
    """How far each sample counts at a pose, (n,) 0..1: nothing where a joint folds it away."""
    samples = shape.samples
    counts = samples.trust.copy()
    bends = np.append(np.clip(shape.palm * bends_of(vector), 0.0, 2.4), 0.0)
    for segment in (1, 2, 3):
        nodes = shape.sides[segment, shape.palm]
        own = (samples.segment == segment) & (samples.side == shape.palm)
        half = float(np.median(shape.distances[nodes]))
        # Two bones' palmar sides meet that far from the joint.
        start, end = half * np.tan(0.5 * bends[segment : segment + 2])
        along = samples.origin[:, 0]
        hidden = (bends[segment] > 0.0) & (along < start + _FOLD_PX)
        if segment < 3:
            hidden |= (bends[segment + 1] > 0.0) & (
                along > shape.lengths[segment - 1] - end - _FOLD_PX
            )
        counts[own & hidden] = 0.0
    return counts


def sampled_sides(
    spans: dict[tuple[int, int], tuple[float, float, float, int]], step_px: float
) -> tuple[list, dict[tuple[int, int], list[int]]]:
    """Rows of samples and the nodes of each side.

    spans: (segment, side) -> length px, first and last share of it, number of nodes.
    """
    rows: list[tuple[float, ...]] = []
    sides: dict[tuple[int, int], list[int]] = {}
    start = 0
    for (segment, side), (length, low, high, count) in spans.items():
        sides[segment, side] = list(range(start, start + count))
        number = max(6, round((high - low) * length / step_px))
        for share in np.linspace(0.0, count - 1.0, number):
            node = min(int(share), count - 2)
            part = share - node
            at = length * (low + (high - low) * share / (count - 1))
            rows.append((segment, side, at, start + node, start + node + 1, 1.0 - part, part))
        start += count
    return rows, sides


def flesh_shares(
    segment: np.ndarray, side: np.ndarray, along: Array, lengths: Array, base: float
) -> tuple[Array, np.ndarray, Array]:
    """Flesh terms (n, m) of every side beside every joint, their joints (m,), trust (n,)."""
    columns, joints = [], []
    trust = np.ones(len(segment))
    for number in range(SEGMENTS):
        length = base if number == 0 else lengths[number - 1]
        share = along / length + (number == 0)
        for one in (-1, 1):
            own = (segment == number) & (side == one)
            for joint, distance in ((number, share), (number + 1, 1.0 - share)):
                if not own.any() or not 1 <= joint <= 3:
                    continue
                near = np.clip(1.0 - distance / _FLESH_SHARE, 0.0, 1.0) ** 2
                columns.append(np.where(own, near, 0.0))
                joints.append(joint)
                if number:
                    close = np.clip(1.0 - distance / _JOINT_SHARE, 0.0, 1.0)
                    trust[own] *= 1.0 / (1.0 + close[own] ** 2)
    return np.stack(columns, axis=1), np.array(joints), trust
