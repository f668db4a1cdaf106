"""A finger's silhouette from the first picture, in which somebody pointed at its joints. Pure.

The back of a finger stands out from what is behind it; its palm's side runs beside its neighbours,
whose outlines look like its own. So the back's distances are measured here, and those of the palm's
side begin as wide as the back's, since joints are clicked in the middle of the finger; all pictures
together correct them (adjust.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.errors import CaptureError
from studies.grasp.measure.edges.contrast import Picture, edges_along, profiles, tukey
from studies.grasp.measure.edges.outline import (
    Link,
    Side,
    first_widths,
    frame_of,
    learn_link,
    links_of,
    refined_widths,
    tip_end,
)
from studies.grasp.measure.edges.segments import Array, Edges
from studies.grasp.measure.edges.silhouette import (
    Samples,
    Silhouette,
    bends_of,
    flesh_shares,
    lay,
    normals_of,
    sampled_sides,
)

# Samples lie so far apart along the bone; the fingertip has so many, within so many rad of it.
_STEP_PX, _CAP_SAMPLES, _CAP_NODES, _CAP_RAD = 3.0, 15, 5, 1.1
# The part of each side that is its own (shares of its bone, nodes). The palm's side of the proximal
# phalanx begins beyond the web of the hand.
_BACK = {0: (-0.95, -0.25, 4), 1: (0.1, 0.9, 5), 2: (0.1, 0.9, 4), 3: (0.1, 0.8, 4)}
_PALM = {1: (0.35, 0.9, 4), 2: (0.1, 0.9, 4), 3: (0.1, 0.8, 4)}
# Pads make the palm's side this much wider than the back's, px: half of what it was on tuned
# people (subjects 1, 3, 5: 1 to 3).
_PAD_PX = 1.0
_WIDTH_ROUNDS = 4
# Rounds of fitting the back's distances, each with the reach of the search.
_REACHES_PX = (6.0, 3.0, 3.0)


class Learnt(NamedTuple):
    """The silhouette and the pose (6,) of the first picture."""

    shape: Silhouette
    vector: Array


def widths_beside(edges: Edges, joints: Array, names: list[str]) -> Array:
    """How far the outline is from clicked joints (4, 2) to each side, roughly; (2, 4) px, signed.

    Raises CaptureError where the seeds are not on a finger.
    """
    if np.hypot(*np.diff(joints, axis=0).T).min() < 3.0:
        raise CaptureError("seeds: two joints are at the same place; each has its own")
    widths = first_widths(edges, joints, names)
    for _ in range(_WIDTH_ROUNDS):
        widths = refined_widths(edges, joints, widths)
    return widths


def learn(
    colours: Picture, edges: Edges, joints: Array, widths: Array, base: tuple[Array, Link] | None
) -> Learnt:
    """The silhouette; base: where the back of the hand begins, and its outline."""
    lengths = np.hypot(*np.diff(joints, axis=0).T)
    turns = np.unwrap([np.arctan2(*(joints[k + 1] - joints[k])[::-1]) for k in range(3)])
    palm = 1 if turns[2] >= turns[0] else -1
    start = turns[0]
    if base is not None:
        u, _, _ = frame_of(base[0], joints[0])
        start = turns[0] - (turns[0] - np.arctan2(u[1], u[0]) + np.pi) % (2.0 * np.pi) + np.pi
    vector = np.array([*joints[0], start, *turns])
    back = np.abs(widths[0 if palm > 0 else 1])  # (4,)
    end = tip_end(edges, joints[2], joints[3], links_of(widths, lengths.tolist())[2])
    shape = _built(lengths, back, end, palm, base, vector)
    return Learnt(_measured(shape, colours, vector), vector)


def learn_base(edges: Edges, b1: Array, mcp: Array, widest: float, palm: int) -> Link | None:
    """The outline of the back of the hand along the line b1 - mcp; None where there is none."""
    link = learn_link(edges, b1, mcp, widest)
    if link.sides == (None, None):
        return None
    left, right = link.sides
    first, second = (left, right) if palm > 0 else (right, left)
    own = first or second
    return Link(link.length, (left, None) if own is left else (None, right))


def _built(
    lengths: Array,
    back: Array,
    end: float | None,
    palm: int,
    base: tuple[Array, Link] | None,
    vector: Array,
) -> Silhouette:
    """The silhouette with the distances that straight sides have."""
    # A tip is clicked on its outline or in its middle: the round end's centre is as far from the
    # end as from the sides.
    reach = float(lengths[2]) + 0.5 * float(back[3]) if end is None else end
    centre = max(reach - float(back[3]), 0.5 * float(lengths[2]))
    length = base[1].length if base else float(lengths[0])
    bones = (length, float(lengths[0]), float(lengths[1]), centre)
    spans: dict[tuple[int, int], tuple[float, float, float, int]] = {}
    base_side: Side | None = None
    if base is not None:
        left, right = base[1].sides
        base_side = left or right
        spans[0, -1 if left else 1] = (length, *_BACK[0])
    for segment in (1, 2, 3):
        spans[segment, -palm] = (bones[segment], *_BACK[segment])
        spans[segment, palm] = (bones[segment], *_PALM[segment])
    rows, sides = sampled_sides(spans, _STEP_PX)
    cap_start = sum(span[3] for span in spans.values())
    distances = np.zeros(cap_start + _CAP_NODES)
    for (segment, side), nodes in sides.items():
        low, high = spans[segment, side][1:3]
        shares = np.linspace(low, high, len(nodes))
        if segment == 0 and base_side is not None:
            width = np.abs(base_side.start + (base_side.end - base_side.start) * (1.0 + shares))
        else:
            width = back[segment - 1] + (back[segment] - back[segment - 1]) * shares
        distances[nodes] = width + (_PAD_PX if side == palm and segment else 0.0)
    distances[cap_start:] = reach - centre
    samples, flesh_joints = _samples(rows, cap_start, centre, lengths, length)
    return Silhouette(
        samples,
        distances,
        lengths,
        length,
        np.zeros(len(flesh_joints)),
        flesh_joints,
        bends_of(vector),
        sides,
        list(range(cap_start, cap_start + _CAP_NODES)),
        palm,
    )


def _samples(
    rows: list, cap_start: int, centre: float, lengths: Array, base: float
) -> tuple[Samples, np.ndarray]:
    """Those of the sides and of the fingertip, and the joints of the flesh terms."""
    table = np.array(rows)
    angles = np.linspace(-_CAP_RAD, _CAP_RAD, _CAP_SAMPLES)
    share = (angles / _CAP_RAD + 1.0) * 0.5 * (_CAP_NODES - 1)
    node = np.minimum(share.astype(int), _CAP_NODES - 2)
    count = len(table)
    segment = np.append(table[:, 0], np.full(_CAP_SAMPLES, 3.0)).astype(int)
    side = np.append(table[:, 1], np.zeros(_CAP_SAMPLES)).astype(int)
    along = np.append(table[:, 2], np.full(_CAP_SAMPLES, centre))
    origin = np.stack([along, np.zeros(len(along))], axis=1)
    direction = np.zeros((count + _CAP_SAMPLES, 2))
    direction[:count, 1] = table[:, 1]
    direction[count:] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    cap_nodes = cap_start + np.stack([node, node + 1], axis=1)
    nodes = np.concatenate([table[:, 3:5].astype(int), cap_nodes])
    part = share - node
    shares = np.concatenate([table[:, 5:7], np.stack([1.0 - part, part], axis=1)])
    flesh, joints, trust = flesh_shares(segment, side, along, lengths, base)
    return Samples(segment, side, origin, direction, nodes, shares, flesh, trust), joints


def _measured(shape: Silhouette, colours: Picture, vector: Array) -> Silhouette:
    """The distances of the back and the tip as the picture has them."""
    samples = shape.samples
    own = (samples.side == -shape.palm) | (samples.segment == 0)
    for reach in _REACHES_PX:
        laid = lay(shape, normals_of(shape), vector)
        found = edges_along(profiles(colours, laid.points, laid.normals, reach), None)
        best = np.argmax(found.weights, axis=1)
        rows = np.arange(len(best))
        miss = found.offsets[rows, best]
        weights = own * (found.weights[rows, best] > 0.0) * tukey(miss, 2.0 * reach)
        by_node = laid.by_shape[:, : len(shape.distances)]
        # Where no edge is, a distance stays.
        normal = by_node.T @ (weights[:, None] * by_node) + 0.05 * np.eye(by_node.shape[1])
        step = np.linalg.solve(normal, by_node.T @ (weights * miss))
        shape = shape.changed(shape.distances + step, shape.lengths, shape.flesh)
    return shape
