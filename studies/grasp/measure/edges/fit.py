"""The chain laid into the edges of a picture: Gauss-Newton on where its outline should be. Pure.

Unknowns: the MCP joint (x, y) and the direction of each link. Lengths stay as learned. An edge
pixel beside a link is compared with the link's side, one beyond the last joint with the fingertip's
end; Tukey's weights keep out what belongs to something else. What no edge says is held by the
prediction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from studies.grasp.measure.edges.outline import Link
from studies.grasp.measure.edges.segments import Array, Edges

# How far from its side an edge may be, as a share of half the finger's width: first, and later.
_REACH, _LEAST_REACH_PX = (0.7, 0.5, 0.35, 0.25, 0.2, 0.2), 3.0
# An edge runs along its link within this angle.
_ALONG, _ACROSS = np.cos(np.radians(30.0)), 0.75
_INNER, _BINS, _NEAR_PX = (0.12, 0.88), 12, 2.0
# Of the base line, the part before the knuckle, which swells as the finger bends.
_KNUCKLE = 0.7
# Standard deviation of an edge pixel about a straight side: skin folds and bulges. Pixels of one
# fold err together: so many count as one.
_EDGE_SIGMA_PX, _TOGETHER = 1.0, 6.0
# Fingers bend so far, and extend so far beyond straight, at MCP, PIP and DIP (rad): a fifth more
# than people do.
_FLEXED, _EXTENDED = np.radians((110.0, 130.0, 105.0)), np.radians((50.0, 20.0, 40.0))
# By how much a phalanx' outline moves beside its bone as the finger bends: skin slides, flesh
# bulges. Standard deviation.
_FLESH_SIGMA_PX = 1.0
# Turns about the prediction from which a chain is laid into the edges, degrees, of each phalanx.
_STARTS = (
    (0.0, 0.0, 0.0),
    (0.0, 8.0, 8.0),
    (0.0, -8.0, -8.0),
    (0.0, 8.0, 16.0),
    (0.0, -8.0, -16.0),
)
# How far a joint may be from its prediction: a hand's sway, and a finger's acceleration; per
# picture. Standard deviations.
_ROOT_SIGMA_PX, _TURN_SIGMA_RAD, _BASE_SIGMA_RAD = 2.0, np.radians(8.0), np.radians(0.3)


class Chain(NamedTuple):
    """Where the links are: the MCP joint (2,), and the directions (k,) rad, base line first.

    Without a base line the first direction is that of the proximal phalanx.
    """

    mcp: Array
    directions: Array


class Outline(NamedTuple):
    """What was learned: base link or None, three phalanges, the end of the tip beyond DIP in px."""

    base: Link | None
    phalanges: tuple[Link, Link, Link]
    end: float | None

    @property
    def links(self) -> list[Link]:
        return [*([self.base] if self.base else []), *self.phalanges]


class Fitted(NamedTuple):
    """The chain; covariance (2 + k, 2 + k) of mcp and directions; cover (k, 2) of sides; score."""

    chain: Chain
    cov: Array
    cover: Array
    score: float


def joints_of(outline: Outline, chain: Chain) -> Array:
    """MCP, PIP, DIP, tip; (4, 2)."""
    turns = chain.directions[-3:]
    lengths = np.array([link.length for link in outline.phalanges])
    steps = lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return chain.mcp + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def within_limits(directions: Array, side: int) -> Array:
    """Directions (k,) of links that no finger exceeds; side: +1 where flexion turns clockwise."""
    result = directions.copy()
    first = 4 - len(directions)
    for joint in range(first, 3):
        link = joint - first + 1
        bend = side * (directions[link] - directions[link - 1])
        bend = float(np.clip(bend, -_EXTENDED[joint], _FLEXED[joint]))
        result[link] = result[link - 1] + side * bend
    return result


def fit(edges: Edges, outline: Outline, predicted: Chain, side: int) -> Fitted:
    """The chain that the edges of one picture show; side: +1 where flexion turns clockwise.

    A finger's outline runs beside those of its neighbours, so there are several places where a
    chain rests; of those reached from turns about the prediction, the one along which most edges
    are is taken.
    """
    starts = []
    for turns in _STARTS:
        turned = predicted.directions.copy()
        turned[-3:] += side * np.radians(turns)
        starts.append(Chain(predicted.mcp, within_limits(turned, side)))
    return max((_rest(edges, outline, start, predicted, side) for start in starts), key=_score)


def _score(fitted: Fitted) -> float:
    return fitted.score


def _rest(edges: Edges, outline: Outline, start: Chain, predicted: Chain, side: int) -> Fitted:
    """Where a chain comes to rest from a start."""
    k = len(outline.links)
    x = np.concatenate([start.mcp, start.directions, np.zeros(3)])  # (5 + k,)
    held = np.concatenate([predicted.mcp, predicted.directions, np.zeros(3)])
    turns = [_BASE_SIGMA_RAD] * (k - 3) + [_TURN_SIGMA_RAD] * 3
    prior = np.concatenate([[_ROOT_SIGMA_PX] * 2, turns, [_FLESH_SIGMA_PX] * 3]) ** -2.0
    cover = np.zeros((k, 2))
    normal = np.diag(prior)
    for reach in _REACH:
        chain = Chain(x[:2], x[2 : 2 + k])
        rows, residuals, weights, cover = _equations(edges, outline, chain, x[2 + k :], reach)
        normal = rows.T @ (weights[:, None] * rows) + np.diag(prior)
        right = rows.T @ (weights * residuals) + prior * (held - x)
        x = x + np.linalg.solve(normal, right)
        x[2 : 2 + k] = within_limits(x[2 : 2 + k], side)
    # An unlikely turn costs as much as a side that is not seen, at three sigmas.
    far = float(np.sum(prior[2 : 2 + k] * np.square(held - x)[2 : 2 + k]))
    score = float(cover.sum()) - far / 9.0
    cov = np.linalg.inv(normal)[: 2 + k, : 2 + k]
    return Fitted(Chain(x[:2], x[2 : 2 + k]), np.asarray(cov), cover, score)


def _equations(
    edges: Edges, outline: Outline, chain: Chain, flesh: Array, reach: float
) -> tuple[Array, Array, Array, Array]:
    """Rows (m, 2 + k) of the Jacobian, residuals (m,), weights (m,), and cover (k, 2)."""
    links = outline.links
    k, first = len(links), len(links) - 3
    joints = joints_of(outline, chain)
    rows, residuals, weights = [np.empty((0, 5 + k))], [np.empty(0)], [np.empty(0)]
    cover = np.zeros((k, 2))
    for number, link in enumerate(links):
        u = np.array([np.cos(chain.directions[number]), np.sin(chain.directions[number])])
        n = np.array([-u[1], u[0]])
        # A base line is held at its end, the MCP joint; a phalanx at its start.
        phalanx = number - first
        pivot = joints[max(phalanx, 0)]
        offset = edges.points - pivot
        distance, across = offset @ u, offset @ n
        along = distance / link.length + (1.0 if phalanx < 0 else 0.0)
        inner = (along > _INNER[0]) & (along < (_INNER[1] if phalanx >= 0 else _KNUCKLE))
        inner &= np.abs(edges.directions @ u) >= _ALONG
        limit = max(reach * link.width, _LEAST_REACH_PX)
        for side_number, side in enumerate(link.sides):
            if side is None:
                continue
            miss = across - side.start - (side.end - side.start) * along
            miss -= flesh[phalanx] if phalanx >= 0 else 0.0
            own = np.flatnonzero(inner & (np.abs(miss) < limit))
            cover[number, side_number] = _cover(along[own], miss[own])
            row = _rows(n, -distance[own], number, phalanx, chain, outline, k)
            if phalanx >= 0:
                row[:, 2 + k + phalanx] = 1.0
            rows.append(row)
            residuals.append(miss[own])
            weights.append(_tukey(miss[own], limit) * edges.strength[own])
        if phalanx == 2 and outline.end is not None:
            end = outline.end - across**2 / (2.0 * max(link.width, 1.0))
            miss = distance - end
            own = np.flatnonzero(
                (np.abs(miss) < limit)
                & (np.abs(across) < 0.5 * link.width)
                & (np.abs(edges.directions @ u) <= _ACROSS)
            )
            rows.append(_rows(u, across[own], number, phalanx, chain, outline, k))
            residuals.append(miss[own])
            weights.append(_tukey(miss[own], limit) * edges.strength[own])
    scale = 1.0 / (_TOGETHER * _EDGE_SIGMA_PX**2)
    return np.concatenate(rows), np.concatenate(residuals), scale * np.concatenate(weights), cover


def _rows(
    axis: Array, by_turn: Array, number: int, phalanx: int, chain: Chain, outline: Outline, k: int
) -> Array:
    """Minus the derivatives (m, 2 + k) of residuals measured along an axis (2,) of one link.

    by_turn (m,): the residual's derivative by the link's own direction.
    """
    rows = np.zeros((len(by_turn), 5 + k))
    rows[:, :2] = axis
    for earlier in range(phalanx):
        link = k - 3 + earlier
        turn = chain.directions[link]
        length = outline.phalanges[earlier].length
        rows[:, 2 + link] = length * (axis @ np.array([-np.sin(turn), np.cos(turn)]))
    rows[:, 2 + number] = -by_turn
    return rows


def _tukey(miss: Array, limit: float) -> Array:
    return (1.0 - np.square(miss / limit)) ** 2


def _cover(along: Array, miss: Array) -> float:
    """The share of a side along which an edge is near it."""
    near = along[np.abs(miss) < _NEAR_PX]
    share = (near - _INNER[0]) / (_INNER[1] - _INNER[0])
    hit = np.zeros(_BINS, bool)
    hit[np.clip((share * _BINS).astype(int), 0, _BINS - 1)] = True
    return float(hit.mean())
