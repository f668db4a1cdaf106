"""A plain finger's joints the paper's way (section 4), picture after picture. Pure.

In the first one a person says where the joints are; the outline is learned there (outline.py), and
laid into each later picture from where it was before (fit.py). That says where the paper's regions
lie, of which the centroids are the joints.

"Each region (B1, B2, and A1 to A4) is represented by a bounding box having a convex polygonal area
inside defined by the intersection points of fitted line segments within the box. The centroid of
each convex polygonal region represents the end point of the median line." A box' half side is half
the finger's width: a larger one holds more of the inside of a bent joint than of its outside, and
pulls the centroid there.
"""

from __future__ import annotations

from itertools import combinations, product

import cv2
import numpy as np

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import bgr_image
from studies.grasp.measure.edges.fit import Chain, Fitted, Outline, fit, joints_of
from studies.grasp.measure.edges.outline import (
    Link,
    first_widths,
    frame_of,
    learn_link,
    links_of,
    refined_widths,
    tip_end,
)
from studies.grasp.measure.edges.segments import Array, Edges, edges_near
from studies.grasp.measure.joints import B1, B2, Finger, Place, Seen
from studies.grasp.measure.joints import joints_of as names_of
from studies.grasp.measure.seeds import Seeds

# Beside a phalanx, outlines are looked for up to this share of its length, when they are learned.
_LEARN_REACH = 0.8
# Rounds in which widths are learned.
_ROUNDS = 4
# Later, up to so many half widths: the outline, and what moves within a picture.
_REACH_WIDTHS = 2.6
# A phalanx of which less of both sides is seen than this, on average, was not measured.
_LEAST_COVER = 0.25
# The back of the hand: its outline may be further from the base line than this link is long.
_WIDEST_BASE = 1.5
# A turn goes on as it was, less a little: fingers that stop are as many as those that go on.
_MOMENTUM = 0.7
# Lines of less cover than this are not seen.
_LINE_COVER = 0.3
_ALONG = np.cos(np.radians(20.0))
_NEAR_PX = 3.0
# A line: a point (2,) on it and its unit direction (2,).
Line = tuple[Array, Array]


class PaperFinder:
    """One finger."""

    def __init__(self, finger: Finger, seeds: Seeds) -> None:
        self._names = list(names_of(finger).values())
        self._base_names = (f"{finger}_{B1}", f"{finger}_{B2}")
        self._seeds = seeds
        self._outline: Outline | None = None
        self._chain = Chain(np.zeros(2), np.zeros(3))
        self._velocity = np.zeros(3)
        self._side = 1
        # B1 and B2 in the base link's frame: along it from the MCP joint, and across.
        self._base_points = np.zeros((2, 2))

    def find(self, frame: Frame) -> Seen:
        """The joints of one picture, and why others are missing."""
        grey = cv2.cvtColor(bgr_image(frame), cv2.COLOR_BGR2GRAY)
        if self._outline is None:
            self._outline = self._learn(grey)
        outline = self._outline
        predicted = Chain(self._chain.mcp, self._chain.directions + _MOMENTUM * self._velocity)
        edges = edges_near(grey, self._path(outline, predicted), _REACH_WIDTHS * self._width)
        fitted = fit(edges, outline, predicted, self._side)
        self._velocity = fitted.chain.directions - self._chain.directions
        self._chain = fitted.chain
        seen = self._seen(frame, outline, fitted)
        return self._at_centroids(seen, centroids(edges, outline, fitted))

    def _learn(self, grey: Image) -> Outline:
        """Raises CaptureError where the seeds are not on a finger."""
        joints = np.array([self._seeds[name] for name in self._names])  # (4, 2)
        reach = _LEARN_REACH * float(np.median(np.hypot(*np.diff(joints, axis=0).T)))
        edges = edges_near(grey, joints, reach)
        lengths = np.hypot(*np.diff(joints, axis=0).T)
        if lengths.min() < 3.0:
            raise CaptureError("seeds: two joints are at the same place; each has its own")
        directions = np.unwrap([np.arctan2(*(joints[k + 1] - joints[k])[::-1]) for k in range(3)])
        self._side = 1 if directions[2] >= directions[0] else -1
        chain = Chain(joints[0], directions)
        widths = first_widths(edges, joints, self._names)
        for _ in range(_ROUNDS):
            widths = refined_widths(edges, joints, widths)
        links = links_of(widths, lengths.tolist())
        end = tip_end(edges, joints[2], joints[3], links[2])
        self._width = max(link.width for link in links)
        base = self._learn_base(grey, joints[0])
        if base is not None:
            b1, b2 = (np.array(self._seeds[name]) for name in self._base_names)
            u, n, _ = frame_of(b1, b2)
            turn = np.arctan2(u[1], u[0])
            chain = Chain(chain.mcp, np.unwrap([turn, *chain.directions]))
            self._base_points = np.array(
                [[(b - joints[0]) @ u, (b - joints[0]) @ n] for b in (b1, b2)]
            )
        self._chain, self._velocity = chain, np.zeros(len(chain.directions))
        return Outline(base, links, end)

    def _learn_base(self, grey: Image, mcp: Array) -> Link | None:
        """The back of the hand beside the base line; None where no seeds say where that is."""
        if not set(self._base_names) <= set(self._seeds):
            return None
        b1, b2 = (np.array(self._seeds[name]) for name in self._base_names)
        u, _, length = frame_of(b1, b2)
        edges = edges_near(grey, np.array([b1, b2]), _WIDEST_BASE * length)
        # A link that ends at the MCP joint, parallel to the base line, as far back as B1.
        start = mcp - u * max(float((mcp - b1) @ u), length)
        link = learn_link(edges, start, mcp, _WIDEST_BASE)
        if link.sides == (None, None):
            raise CaptureError(
                f"seeds {' and '.join(self._base_names)}: no outline of the hand runs along the "
                "line between them; put them on the back of the hand, or give --base x1,y1,x2,y2"
            )
        # The back of the hand, where it is seen: on the other side fingers move.
        left, right = link.sides
        back, palm = (left, right) if self._side > 0 else (right, left)
        own = back or palm
        return Link(link.length, (left, None) if own is left else (None, right))

    def _path(self, outline: Outline, chain: Chain) -> Array:
        """The points of the chain, base first, near which edges are searched."""
        joints = joints_of(outline, chain)
        if outline.base is None:
            return joints
        turn = chain.directions[0]
        start = joints[0] - outline.base.length * np.array([np.cos(turn), np.sin(turn)])
        return np.concatenate([start[None], joints])

    def _seen(self, frame: Frame, outline: Outline, fitted: Fitted) -> Seen:
        """What was measured, as places with their sigmas."""
        joints = joints_of(outline, fitted.chain)
        first = len(outline.links) - 3
        cover = fitted.cover.mean(axis=1)
        places: dict[str, Place] = {}
        lost: dict[str, str] = {}
        for number, name in enumerate(self._names):
            beside = [k for k in (number - 1, number) if 0 <= k < 3]
            seen = float(np.min(cover[[first + k for k in beside]]))
            x, y = joints[number].tolist()
            if not (0 <= x < frame.size_px[0] and 0 <= y < frame.size_px[1]):
                lost[name] = "out of view"
            elif seen < _LEAST_COVER:
                lost[name] = f"its outline is hidden ({100 * seen:.0f} % seen)"
            else:
                sigma = _sigma(outline, fitted, number)
                places[name] = Place(x, y, sigma, min(1.0, seen / 0.7))
        if first:
            turn = fitted.chain.directions[0]
            u, n = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
            for name, (along, across) in zip(self._base_names, self._base_points, strict=True):
                x, y = (joints[0] + along * u + across * n).tolist()
                places[name] = Place(x, y, _sigma(outline, fitted, 0), 1.0)
        return Seen(frame.seq, 1e-9 * frame.stamp_ns, places, lost)

    def _at_centroids(self, seen: Seen, found: list[Array | None]) -> Seen:
        """The same joints at the centroids of A1 to A4."""
        places, lost = dict(seen.places), dict(seen.lost)
        for name, centroid in zip(self._names, found, strict=True):
            place = places.pop(name, None)
            if place is None:
                continue
            if centroid is None:
                lost[name] = "no polygon of lines: only one side is seen"
                continue
            x, y = centroid.tolist()
            places[name] = place._replace(x_px=x, y_px=y)
        return seen._replace(places=places, lost=lost)


def _sigma(outline: Outline, fitted: Fitted, joint: int) -> float:
    """Of a joint's coordinates, px: the covariance of the chain, carried to it."""
    k = len(outline.links)
    J = np.zeros((2, 2 + k))
    J[:, :2] = np.eye(2)
    for phalanx in range(joint):
        turn = fitted.chain.directions[k - 3 + phalanx]
        length = outline.phalanges[phalanx].length
        J[:, 2 + k - 3 + phalanx] = length * np.array([-np.sin(turn), np.cos(turn)])
    cov = J @ fitted.cov @ J.T
    return float(np.sqrt(0.5 * np.trace(cov)))


def side_lines(edges: Edges, outline: Outline, fitted: Fitted) -> dict[tuple[int, int], Line]:
    """The line fitted to each side of each phalanx (0..2) that is seen, by (phalanx, side)."""
    found: dict[tuple[int, int], Line] = {}
    joints = joints_of(outline, fitted.chain)
    first = len(outline.links) - 3
    for phalanx, link in enumerate(outline.phalanges):
        turn = fitted.chain.directions[first + phalanx]
        u = np.array([np.cos(turn), np.sin(turn)])
        n = np.array([-u[1], u[0]])
        offset = edges.points - joints[phalanx]
        along, across = offset @ u, offset @ n
        inner = (along > 0.1 * link.length) & (along < 0.9 * link.length)
        inner &= np.abs(edges.directions @ u) >= _ALONG
        for number, side in enumerate(link.sides):
            if side is None or fitted.cover[first + phalanx, number] < _LINE_COVER:
                continue
            expected = side.start + (side.end - side.start) * along / link.length
            own = inner & (np.abs(across - expected) < _NEAR_PX)
            if np.count_nonzero(own) < 6 or np.ptp(along[own]) < 0.25 * link.length:
                continue
            slope, level = (float(v) for v in np.polyfit(along[own], across[own], 1))
            direction = u + slope * n
            found[phalanx, number] = (
                joints[phalanx] + level * n,
                direction / np.hypot(1.0, slope),
            )
    return found


def centroids(edges: Edges, outline: Outline, fitted: Fitted) -> list[Array | None]:
    """The centroids (2,) of A1 to A4; None where less than both sides of a joint are seen."""
    lines = side_lines(edges, outline, fitted)
    joints = joints_of(outline, fitted.chain)
    found: list[Array | None] = []
    for joint in range(4):
        links = [phalanx for phalanx in (joint - 1, joint) if 0 <= phalanx <= 2]
        own = [
            lines[key] for phalanx in links for key in ((phalanx, 0), (phalanx, 1)) if key in lines
        ]
        sides = {number for phalanx in links for number in (0, 1) if (phalanx, number) in lines}
        half = float(np.mean([outline.phalanges[phalanx].width for phalanx in links]))
        found.append(_centroid(own, joints[joint], half) if len(sides) == 2 else None)
    return found


def _centroid(lines: list[Line], centre: Array, half: float) -> Array | None:
    """Of the convex polygon of the lines' intersections with each other and with the box."""
    axes: list[Line] = [(np.eye(2)[0], np.eye(2)[1]), (np.eye(2)[1], np.eye(2)[0])]
    border: list[Line] = [
        (centre + sign * half * across, along) for across, along in axes for sign in (-1.0, 1.0)
    ]
    pairs = [*combinations(lines, 2), *product(lines, border)]
    corners = []
    for one, other in pairs:
        crossing = _crossing(one, other)
        if crossing is not None and np.abs(crossing - centre).max() <= half + 1e-6:
            corners.append(crossing)
    if len(corners) < 3:
        return None
    hull = cv2.convexHull(np.array(corners, np.float32)).reshape(-1, 2)
    moments = cv2.moments(hull.reshape(-1, 1, 2))
    if moments["m00"] < 1.0:
        return None
    return np.array([moments["m10"], moments["m01"]]) / moments["m00"]


def _crossing(one: Line, other: Line) -> Array | None:
    """Where two lines meet; None of nearly parallel ones."""
    (p, u), (q, v) = one, other
    sine = float(u[0] * v[1] - u[1] * v[0])
    if abs(sine) < 0.05:
        return None
    step = q - p
    return p + u * float(step[0] * v[1] - step[1] * v[0]) / sine
