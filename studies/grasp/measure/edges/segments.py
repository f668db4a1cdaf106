"""Edges and the line segments fitted to them. Pure.

The paper, section 4: grayscale, "edge extraction (Canny's method) with a threshold value range of
0.2-0.5 and sigma of the Gaussian filter as 1", then "line fitting among the edges with a maximum
deviation from original edge of 2 pixels". The thresholds are shares of the strongest gradient, as
in MATLAB, where they come from; the strongest one near the finger, since a bright window or the
reference rectangle would set them for the whole picture.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.frame import Image

Array = npt.NDArray[np.float64]

_LOW, _HIGH, _SIGMA_PX, _MAX_DEVIATION_PX = 0.2, 0.5, 1.0, 2.0
# "The maximum" without the few pixels of a highlight: this percentile of the gradients beside the
# finger, of which its outline is some 5 %.
_STRONGEST = 95.0
# Gradients of the logarithm: a ratio of light counts the same in light and in shade, on pale skin
# and on dark, where a neighbouring finger is otherwise lost beside a bright wall. Below 16 levels
# the ratio is noise.
_RATIOS = np.round(255.0 * np.log1p(np.arange(256) / 16.0) / np.log1p(255.0 / 16.0)).astype(
    np.uint8
)
# Shorter pieces have no direction of their own.
_SHORTEST_PX = 5.0


class Edges(NamedTuple):
    """Pixels of edges on line segments: place, the segment's unit direction, gradient.

    points (n, 2) px, directions (n, 2) without sign, strength (n,) as a share of the strongest.
    """

    points: Array
    directions: Array
    strength: Array


def edges_near(grey: Image, chain: Array, reach_px: float) -> Edges:
    """The edges of a picture (h, w) not further than reach_px from a chain of points (k, 2)."""
    height, width = grey.shape
    low = np.maximum(np.floor(chain.min(axis=0) - reach_px).astype(int), 0)
    high = np.minimum(np.ceil(chain.max(axis=0) + reach_px).astype(int) + 1, (width, height))
    if np.any(high - low < 8):
        return Edges(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
    part = np.ascontiguousarray(grey[low[1] : high[1], low[0] : high[0]])
    blurred = cv2.GaussianBlur(_RATIOS[part], (0, 0), _SIGMA_PX)
    gx, gy = cv2.Sobel(blurred, cv2.CV_16S, 1, 0), cv2.Sobel(blurred, cv2.CV_16S, 0, 1)
    gradient = np.hypot(gx.astype(np.float64), gy.astype(np.float64))
    near = np.zeros(part.shape, np.uint8)
    path = np.round(chain - low).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(near, [path], False, 255, max(1, round(2.0 * reach_px)))
    strongest = float(np.percentile(gradient[near > 0], _STRONGEST)) if near.any() else 0.0
    if strongest <= 0.0:
        return Edges(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
    edge = cv2.Canny(gx, gy, _LOW * strongest, _HIGH * strongest, L2gradient=True)
    edge = cv2.bitwise_and(edge, near)
    pieces = _pieces(edge)
    if not pieces:
        return Edges(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
    points = np.concatenate([piece for piece, _ in pieces])
    directions = np.concatenate([np.tile(u, (len(piece), 1)) for piece, u in pieces])
    strength = gradient[points[:, 1], points[:, 0]] / strongest
    return Edges(points.astype(np.float64) + low, directions, np.minimum(strength, 1.0))


def _pieces(edge: Image) -> list[tuple[npt.NDArray[np.int64], Array]]:
    """Line segments of an edge map: their pixels (n, 2) and unit direction (2,)."""
    contours = cv2.findContours(edge, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]
    found = []
    for contour in contours:
        line = contour.reshape(-1, 2)
        if len(line) < _SHORTEST_PX:
            continue
        corners = cv2.approxPolyDP(contour, _MAX_DEVIATION_PX, False).reshape(-1, 2)
        at = _indices(line, corners)
        for start, end in pairwise(at):
            step = (line[end] - line[start]).astype(np.float64)
            length = float(np.hypot(*step))
            if length >= _SHORTEST_PX:
                found.append((line[start : end + 1].astype(np.int64), step / length))
    return found


def _indices(line: Image, corners: Image) -> list[int]:
    """Where corners, in their order, are on a line of pixels."""
    found, start = [], 0
    for corner in corners:
        same = np.flatnonzero((line[start:] == corner).all(axis=1))
        if len(same):
            start += int(same[0])
            found.append(start)
    return found
