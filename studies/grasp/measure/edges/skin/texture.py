"""How a finger moved between two pictures, from the skin itself. Pure.

Creases, pores and shading move with each phalanx. What was seen on a grid of each segment in the
picture before is looked for in this one by Gauss-Newton from coarse to fine; the light on a segment
may change as a low polynomial of its place (Hager & Belhumeur 1998). Neighbouring fingers, whose
outlines are like the finger's own, do not move it.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from studies.grasp.measure.edges.contrast import Picture, tukey
from studies.grasp.measure.edges.segments import Array
from studies.grasp.measure.edges.silhouette import POSE, SEGMENTS, Silhouette, bends_of, carried

# Blurs, coarse to fine, and how often is stepped in each.
_LEVELS = ((4.0, 3), (2.0, 2), (0.0, 2))
# About so many points are compared; within this share of a bone, as skin about a joint belongs to
# no one bone, and of half the width, as the outline is shading that stays where the light is.
_POINTS, _ALONG, _ACROSS = 700, (0.15, 0.85), 0.85
# Terms of the light on a segment: 1, along, across, across squared, along times across.
_LIGHT = 5
_LEAST_SCALE = 0.3
# A step's largest: px, rad.
_LARGEST = np.array([8.0, 8.0, 0.2, 0.2, 0.2, 0.2])


class Skin(NamedTuple):
    """The grid: segment (n,), place in its frame (n, 2) px, and its light (n, 4 * 5)."""

    segment: np.ndarray
    local: Array
    light: Array


class Pyramid(NamedTuple):
    """Grey values of each level with both derivatives."""

    levels: tuple[tuple[Picture, Picture, Picture], ...]


class Moved(NamedTuple):
    """Pose (6,), its information (6, 6) by the noise alone, and the misfit, RMS in levels, of
    the segment that fits worst.
    """

    vector: Array
    information: Array
    misfit: float


def skin_of(shape: Silhouette) -> Skin:
    """The grid on a silhouette."""
    widths = {key: float(np.median(shape.distances[nodes])) for key, nodes in shape.sides.items()}
    pieces = []
    for segment in range(SEGMENTS):
        halves = [widths[segment, side] for side in (-1, 1) if (segment, side) in widths]
        if not halves:
            continue
        length = shape.base if segment == 0 else shape.lengths[segment - 1]
        low, high = (-0.95, -0.1) if segment == 0 else _ALONG
        high = 1.0 if segment == 3 else high
        pieces.append((segment, low * length, high * length, float(np.mean(halves))))
    area = sum((high - low) * 2.0 * _ACROSS * half for _, low, high, half in pieces)
    step = max(2.0, float(np.sqrt(area / _POINTS)))
    table = np.array(
        [
            (number, along, across, along / max(abs(low), abs(high)), across / half)
            for number, low, high, half in pieces
            for along in np.arange(low, high, step)
            for across in np.arange(-_ACROSS * half, _ACROSS * half, step)
            # The palm's own edge is no part of the back of the hand.
            if number or shape.palm * across < 0.5 * half
        ]
    )
    along, across = table[:, 3], table[:, 4]
    terms = np.stack([np.ones(len(table)), along, across, across**2, along * across], axis=1)
    segments = table[:, 0].astype(int)
    light = np.zeros((len(table), SEGMENTS * _LIGHT))
    for number in range(SEGMENTS):
        own = segments == number
        light[own, number * _LIGHT : (number + 1) * _LIGHT] = terms[own]
    return Skin(segments, table[:, 1:3], light)


def pyramid_of(colours: Picture) -> Pyramid:
    """Of a picture (h, w, 3) as colours_of has it."""
    levels = []
    grey = np.ascontiguousarray(colours[..., 0])
    for sigma, _ in _LEVELS:
        blurred = cv2.GaussianBlur(grey, (0, 0), sigma) if sigma else grey
        dx = cv2.Sobel(blurred, cv2.CV_32F, 1, 0, scale=0.125)
        dy = cv2.Sobel(blurred, cv2.CV_32F, 0, 1, scale=0.125)
        levels.append((blurred, dx, dy))
    return Pyramid(tuple(levels))  # type: ignore[arg-type]


def remembered(pyramid: Pyramid, skin: Skin, shape: Silhouette, vector: Array) -> list[Array]:
    """What a picture shows on the grid at a pose, (n,) for each level."""
    points, _ = carried(vector, shape.lengths, skin.segment, skin.local)
    return [sampled(level[0], points) for level in pyramid.levels]


def moved(
    pyramid: Pyramid, memory: list[Array], skin: Skin, shape: Silhouette, start: Array
) -> Moved:
    """The pose at which a picture shows what was remembered, from a start near it."""
    vector = start.copy()
    information, scales = np.eye(POSE), np.ones(SEGMENTS)
    for (_, steps), level, before in zip(_LEVELS, pyramid.levels, memory, strict=True):
        for _ in range(steps):
            vector, information, scales = _step(level, before, skin, shape, vector)
    return Moved(vector, information, float(scales.max()))


def _step(
    level: tuple[Picture, Picture, Picture],
    before: Array,
    skin: Skin,
    shape: Silhouette,
    vector: Array,
) -> tuple[Array, Array, Array]:
    points, derivative = carried(vector, shape.lengths, skin.segment, skin.local)
    now, dx, dy = (sampled(plane, points) for plane in level)
    rows = np.concatenate(
        [dx[:, None] * derivative[:, 0] + dy[:, None] * derivative[:, 1], skin.light], axis=1
    )
    miss = before - now
    seen = _unfolded(skin, shape, vector)
    weights, step = seen, np.zeros(rows.shape[1])
    normal, scales = np.eye(rows.shape[1]), np.ones(SEGMENTS)
    for _ in range(2):
        weighted = rows * weights[:, None]
        normal = weighted.T @ rows + 1e-3 * np.eye(rows.shape[1])
        step = np.linalg.solve(normal, weighted.T @ miss)
        rest = miss - rows @ step
        scales = _scales(rest, skin.segment, seen)
        relative = rest / scales[skin.segment]
        weights = seen * tukey(relative, 4.0) / scales[skin.segment] ** 2
    held = normal[:POSE, POSE:] @ np.linalg.solve(normal[POSE:, POSE:], normal[POSE:, :POSE])
    information = normal[:POSE, :POSE] - held
    return vector + np.clip(step[:POSE], -_LARGEST, _LARGEST), information, scales


def _scales(rest: Array, segment: np.ndarray, seen: Array) -> Array:
    """Robust RMS of what is left of each segment's points (n,) that are seen, (4,) in levels.

    Of all together the few points of a fingertip that lies wrong would be the outliers.
    """
    found = np.full(SEGMENTS, _LEAST_SCALE)
    for number in range(SEGMENTS):
        own = rest[(segment == number) & (seen > 0.0)]
        if len(own):
            found[number] += 1.4826 * float(np.median(np.abs(own)))
    return found


def sampled(plane: Picture, points: Array) -> Array:
    """A plane of a picture at points (n, 2) px, between its pixels."""
    x, y = points[:, :1].astype(np.float32), points[:, 1:].astype(np.float32)
    seen = cv2.remap(plane, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen[:, 0], dtype=np.float64)


def _unfolded(skin: Skin, shape: Silhouette, vector: Array) -> Array:
    """Which points (n,) no fold hides, 0 or 1."""
    bends = np.append(np.clip(shape.palm * bends_of(vector), 0.0, 2.4), 0.0)
    depth = np.maximum(shape.palm * skin.local[:, 1], 0.0)
    slopes = np.tan(0.5 * bends)
    lengths = np.concatenate([[1e9], shape.lengths[:2], [1e9]])
    along = skin.local[:, 0]
    near = along >= depth * slopes[skin.segment]
    far = along <= lengths[skin.segment] - depth * slopes[skin.segment + 1]
    return ((near & far) | (skin.segment == 0)).astype(np.float64)
