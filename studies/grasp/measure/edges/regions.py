"""The paper's regions: a box at each joint, and in it the convex polygon of the fitted lines. Pure.

Section 4: "Each region (B1, B2, and A1 to A4) is represented by a bounding box having a convex
polygonal area inside defined by the intersection points of fitted line segments within the box. The
centroid of each convex polygonal region represents the end point of the median line."

Where a box lies the paper leaves to the eye; here the chain says it (fit.py). Its half side is half
the finger's width: a larger one holds more of the inside of a bent joint than of its outside, and
pulls the centroid there.
"""

from __future__ import annotations

from itertools import combinations, product

import cv2
import numpy as np

from studies.grasp.measure.edges.fit import Fitted, Outline, joints_of
from studies.grasp.measure.edges.segments import Array, Edges

# Lines of less cover than this are not seen.
_LEAST_COVER = 0.3
_ALONG = np.cos(np.radians(20.0))
_NEAR_PX = 3.0
# A line: a point (2,) on it and its unit direction (2,).
Line = tuple[Array, Array]


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
            if side is None or fitted.cover[first + phalanx, number] < _LEAST_COVER:
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
