"""The finger as a chain of links with an outline, learned where a person pointed at it. Pure.

Links: the base line (B1 to the MCP joint; where B1, B2 are not given, none) and the three
phalanges. Of each, the two sides: at which distance from the link's median line the outline runs,
at its start and at its end. Beyond the last joint, how far the fingertip's round end is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.errors import CaptureError
from studies.grasp.measure.edges.segments import Array, Edges

# The part of a link whose outline is its own: near joints skin folds and the next link begins.
_INNER = (0.15, 0.85)
# An outline runs along its link within this angle when it is learned: fingers taper, and a click is
# a few pixels off.
_ALONG = np.cos(np.radians(20.0))
# Half a finger's width at its proximal phalanx as a share of that one's length is .2 to .3; more
# where clicks are off the middle. Each further phalanx is no wider than the one before, within so
# much.
_WIDEST, _NARROWING, _NARROWEST_PX = 0.5, 1.15, 2.0
# An outline is seen along this share of its link at least; of several, the innermost which is at
# least half as strong as the strongest: beyond it other fingers and the background begin.
_LEAST_COVER, _NEARLY_STRONGEST, _BINS = 0.45, 0.5, 12
# From a phalanx' start to its end a side comes nearer by a share of its distance of this at most.
_TAPER = 0.4
# Edges of one side lie within so many px of their line.
_BAND_PX = 3.0
# A finger's two sides are about alike: a median line off the middle by more than this share of half
# the width means that a seed is beside the finger.
_LOPSIDED = 0.7


class Side(NamedTuple):
    """Where an outline runs beside a link: distance from its line at start and end, px; signed."""

    start: float
    end: float


class Link(NamedTuple):
    """length px; sides: of negative and positive distance, None where no outline was seen."""

    length: float
    sides: tuple[Side | None, Side | None]

    @property
    def width(self) -> float:
        """Half of the outline's width in the middle, px."""
        seen = [abs(side.start + side.end) / 2.0 for side in self.sides if side is not None]
        return float(np.mean(seen)) if seen else 0.25 * self.length


def frame_of(start: Array, end: Array) -> tuple[Array, Array, float]:
    """A link's direction (2,), normal (2,) and length."""
    step = end - start
    length = float(np.hypot(*step))
    u = step / max(length, 1e-9)
    return u, np.array([-u[1], u[0]]), length


def learn_link(edges: Edges, start: Array, end: Array, widest: float = _WIDEST) -> Link:
    """A link's outline in the picture in which its ends are known."""
    u, n, length = frame_of(start, end)
    offset = edges.points - start
    along, across = offset @ u / max(length, 1e-9), offset @ n
    aligned = np.abs(edges.directions @ u) >= _ALONG
    inner = (along >= _INNER[0]) & (along <= _INNER[1]) & aligned
    sides = tuple(
        _side(along[inner], sign * across[inner], edges.strength[inner], widest * length, sign)
        for sign in (-1.0, 1.0)
    )
    return Link(length, (sides[0], sides[1]))


def _side(along: Array, away: Array, strength: Array, widest: float, sign: float) -> Side | None:
    """The outline among edges at distances `away` > 0 of a link's line."""
    near = (away >= _NARROWEST_PX) & (away <= widest)
    along, away, strength = along[near], away[near], strength[near]
    if not len(away):
        return None
    share = (along - _INNER[0]) / (_INNER[1] - _INNER[0])
    bins = np.minimum((share * _BINS).astype(int), _BINS - 1)
    distances = np.arange(_NARROWEST_PX, widest + 1.0)
    scores = np.zeros(len(distances))
    for number, distance in enumerate(distances):
        band = np.abs(away - distance) <= _BAND_PX
        best = np.zeros(_BINS)
        np.maximum.at(best, bins[band], strength[band])
        cover = float((best > 0.0).mean())
        scores[number] = best.mean() if cover >= _LEAST_COVER else 0.0
    if scores.max() <= 0.0:
        return None
    good = scores >= _NEARLY_STRONGEST * scores.max()
    first = int(np.argmax(good))
    # The best of the innermost run.
    last = first + int(np.argmin(np.append(good[first:], False)))
    distance = float(distances[first + int(np.argmax(scores[first:last]))])
    slope, level = 0.0, distance
    for _ in range(3):
        band = np.abs(away - level - slope * along) <= _BAND_PX
        if np.count_nonzero(band) < 6 or np.ptp(along[band]) < 0.3:
            break
        slope, level = (float(v) for v in np.polyfit(along[band], away[band], 1))
        slope = float(np.clip(slope, -_TAPER * level, _TAPER * level))
        level = float(np.median(away[band] - slope * along[band]))
    return Side(sign * level, sign * (level + slope))


def first_widths(edges: Edges, joints: Array, names: list[str]) -> Array:
    """How far the outline is from joints (4, 2) to each side, roughly; (2, 4) px, signed.

    Raises CaptureError where no finger is seen beside a phalanx.
    """
    middles = np.empty((2, 3))
    widest = _WIDEST * float(np.hypot(*(joints[1] - joints[0])))
    for k in range(3):
        length = float(np.hypot(*(joints[k + 1] - joints[k])))
        link = learn_link(edges, joints[k], joints[k + 1], widest / length)
        widest = min(widest, _NARROWING * link.width)
        _check(link, names[k], names[k + 1])
        for number, side in enumerate(link.sides):
            # Where one side is hidden in the first picture, the seeds are taken for the middle.
            other = link.sides[1 - number]
            known = side or (Side(-other.start, -other.end) if other else Side(0.0, 0.0))
            middles[number, k] = 0.5 * (known.start + known.end)
    ends = 1.5 * middles[:, 0] - 0.5 * middles[:, 1]
    between = 0.5 * (middles[:, 1:] + middles[:, :-1])
    return np.column_stack([ends, between, middles[:, 2]])


def links_of(widths: Array, lengths: list[float]) -> tuple[Link, Link, Link]:
    """Phalanges whose outline runs from joint to joint at distances (2, 4)."""
    first, second, third = (
        Link(
            lengths[k],
            (
                Side(float(widths[0, k]), float(widths[0, k + 1])),
                Side(float(widths[1, k]), float(widths[1, k + 1])),
            ),
        )
        for k in range(3)
    )
    return first, second, third


def refined_widths(edges: Edges, joints: Array, widths: Array) -> Array:
    """The distances (2, 4) that edges near the present outline have."""
    refined = widths.copy()
    for number in range(2):
        rows, targets, weights = [np.eye(4)], [widths[number]], [np.ones(4)]
        for k in range(3):
            u, n, length = frame_of(joints[k], joints[k + 1])
            offset = edges.points - joints[k]
            along, across = offset @ u / length, offset @ n
            expected = widths[number, k] + (widths[number, k + 1] - widths[number, k]) * along
            own = (along > _INNER[0]) & (along < _INNER[1])
            own &= np.abs(across - expected) < _BAND_PX
            own &= np.abs(edges.directions @ u) >= _ALONG
            row = np.zeros((int(np.count_nonzero(own)), 4))
            row[:, k], row[:, k + 1] = 1.0 - along[own], along[own]
            rows.append(row)
            targets.append(across[own])
            weights.append(edges.strength[own])
        A, b, w = np.concatenate(rows), np.concatenate(targets), np.concatenate(weights)
        solved = np.linalg.solve(A.T @ (w[:, None] * A), A.T @ (w * b))
        # Narrower from joint to joint, also where a neighbour's outline is taken for its own.
        refined[number] = np.sign(solved) * np.minimum.accumulate(np.abs(solved))
    return refined


def _check(link: Link, start: str, end: str) -> None:
    left, right = link.sides
    if left is None and right is None:
        raise CaptureError(
            f"seeds {start} and {end}: no finger is seen beside the line between them; put the "
            "seeds on the middle of the finger, and see that it stands out from the background"
        )
    if left is not None and right is not None:
        shift = 0.25 * abs(left.start + left.end + right.start + right.end)
        if shift > _LOPSIDED * link.width:
            raise CaptureError(
                f"seeds {start} and {end}: are not in the middle of a finger; one of them is off "
                "the finger"
            )


def tip_end(edges: Edges, dip: Array, tip: Array, link: Link) -> float | None:
    """How far beyond the DIP joint the fingertip's outline crosses the median line, px.

    The nearest outline that does: beyond it the other fingers' tips may be.
    """
    u, n, length = frame_of(dip, tip)
    offset = edges.points - dip
    along, across = offset @ u, offset @ n
    cap = (
        (np.abs(across) <= 0.5 * link.width)
        & (along >= 0.9 * length)
        & (along <= length + 2.0 * link.width)
        & (np.abs(edges.directions @ u) <= 0.7)
    )
    ends = along[cap] + across[cap] ** 2 / (2.0 * max(link.width, 1.0))
    # As many pixels as half of the cap's width has, within a band.
    for end in np.sort(ends):
        near = np.abs(ends - end - _BAND_PX) <= _BAND_PX
        if np.count_nonzero(near) >= max(3.0, 0.4 * link.width):
            return float(np.median(ends[near]))
    return None
