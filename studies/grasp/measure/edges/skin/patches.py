"""Where each phalanx' skin is in every picture of a recording, against what all of them show. Pure.

From picture to picture a small error stays and adds up; a joint is a centre of rotation only to one
who knows how both its bones moved over the whole recording. So each phalanx' skin is kept as a
picture of its own, laid out along its bone, and found again, by itself, in the mean of all. Shading
stays with the lamp as a finger turns, and flesh that folds beside a joint shades the skin about it
as far as the joint is bent, which looks like skin that slides: what is smooth across a finger is
taken out (Legendre polynomials), and at last only what is fine counts, pores and creases.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from studies.grasp.measure.edges.contrast import Picture, tukey
from studies.grasp.measure.edges.segments import Array
from studies.grasp.measure.edges.silhouette import (
    SEGMENTS,
    Silhouette,
    bends_of,
    joints_at,
)
from studies.grasp.measure.edges.skin.texture import sampled

# The skin that is compared: shares of a bone, of the back of the hand and of half the width.
# Beyond .65 of that a finger turns away from the camera and shading is steep.
_ALONG, _BACK, _ACROSS = (0.15, 0.85), (-0.8, -0.12), 0.65
# Points lie so far apart, and the pictures kept reach so far beyond, px: followed fingers are up to
# 15 deg off, which is 6 px in the middle of a phalanx.
_STEP_PX, _MARGIN_PX = 2.0, 9
# Degrees of the light's polynomials across: constant, linear and square along the bone. Error of
# the proximal phalanx' turn over subjects 1, 3, 5 from the truth on: 0.8 deg with (2, 1, 0), 0.4
# with these, 0.5 with two degrees more.
_LIGHT = (5, 3, 1)
_STEPS, _LEAST_SCALE = 4, 0.3
_LARGEST = np.array([3.0, 3.0, 0.1])
# In so many pictures a point of skin must be seen to be compared, and of those of a picture so many
# must not be folded away.
_OFTEN, _LEAST_SHOWN = 3.0, 0.4

Kept = tuple[npt.NDArray[np.float16], ...]


class Window(NamedTuple):
    """A segment's part of the picture: low (2,) px in its frame, columns along and rows across;
    local (n, 2) px the points compared; light (n, m); centre (2,) of them.
    """

    low: Array
    size: tuple[int, int]
    local: Array
    light: Array
    centre: Array


class Placed(NamedTuple):
    """Of each picture and segment where the skin's centre is and how it is turned, (f, 4, 3) px and
    rad, in the frame (4, 3) of the poses it was looked for from; weights (f, 4) 0..1.
    """

    poses: Array
    weights: Array
    centres: Array


def windows_of(shape: Silhouette) -> list[Window | None]:
    """One for each segment; None without a back of the hand."""
    found: list[Window | None] = []
    for segment in range(SEGMENTS):
        halves = [
            float(np.median(shape.distances[nodes]))
            for (own, _), nodes in shape.sides.items()
            if own == segment
        ]
        if not halves:
            found.append(None)
            continue
        length = shape.base if segment == 0 else float(shape.lengths[segment - 1])
        low, high = _BACK if segment == 0 else _ALONG
        reach = _ACROSS * float(np.mean(halves))
        sides = sorted((-reach * shape.palm, (0.3 if segment == 0 else 1.0) * reach * shape.palm))
        along = np.arange(low * length, (1.0 if segment == 3 else high) * length, _STEP_PX)
        across = np.arange(sides[0], sides[1], _STEP_PX)
        local = np.array([(a, b) for a in along for b in across])
        corner = np.floor(local.min(axis=0)) - _MARGIN_PX
        width, height = (np.ceil(local.max(axis=0)) + _MARGIN_PX - corner + 1.0).astype(int)
        found.append(
            Window(corner, (int(width), int(height)), local, _light(local), local.mean(axis=0))
        )
    return found


def _light(local: Array) -> Array:
    """Terms of the light (n, m) at places (n, 2)."""
    low, high = local.min(axis=0), local.max(axis=0)
    along, across = (2.0 * (local - low) / (high - low) - 1.0).T
    across_terms = np.polynomial.legendre.legvander(across, max(_LIGHT))
    return np.concatenate(
        [
            along[:, None] ** power * across_terms[:, : degree + 1]
            for power, degree in enumerate(_LIGHT)
        ],
        axis=1,
    )


def kept_of(
    colours: Picture, windows: Sequence[Window | None], shape: Silhouette, vector: Array
) -> Kept:
    """The light of a picture in each window at a pose."""
    grey = np.ascontiguousarray(colours[..., 0])
    pieces = []
    for start, window in zip(starts_of(shape, vector), windows, strict=True):
        if window is None:
            pieces.append(np.zeros((1, 1), np.float16))
            continue
        c, s = np.cos(start[2]), np.sin(start[2])
        turn = np.array([[c, -s], [s, c]])
        into = np.column_stack([turn, start[:2] + turn @ window.low])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        border = cv2.BORDER_REPLICATE
        seen = cv2.warpAffine(grey, into, window.size, flags=flags, borderMode=border)
        pieces.append(seen.astype(np.float16))
    return tuple(pieces)


def starts_of(shape: Silhouette, vector: Array) -> Array:
    """Each segment's frame at a pose, (4, 3): origin px, turn rad."""
    joints = joints_at(vector, shape.lengths)
    return np.column_stack([joints[[0, 0, 1, 2]], vector[2:]])


def placed(
    kept: Sequence[Kept],
    windows: Sequence[Window | None],
    followed: tuple[Silhouette, Array],
    now: tuple[Silhouette, Array],
    fine_px: float | None = None,
) -> Placed:
    """Where skin is. followed: shape and poses (f, 6) at which pictures were kept; now: those that
    are known better; fine_px: only what is finer than so many px (sigma) is compared, which has to
    be known to about as many beforehand.
    """
    before = np.stack([starts_of(followed[0], vector) for vector in followed[1]])  # (f, 4, 3)
    starts = np.stack([starts_of(now[0], vector) for vector in now[1]])
    found = Placed(starts.copy(), np.zeros(starts.shape[:2]), np.zeros((SEGMENTS, 2)))
    bends = np.stack([np.append(bends_of(vector), 0.0) for vector in now[1]])
    for segment, window in enumerate(windows):
        if window is None:
            continue
        found.centres[segment] = window.centre
        own = within(starts[:, segment], before[:, segment], window.low)
        shown = np.stack([_unfolded(window, segment, now[0], bend) for bend in bends])
        images = [_fine(one[segment].astype(np.float32), fine_px) for one in kept]
        turned, weights = _registered(images, window, own, shown)
        found.poses[:, segment] = _without(turned, before[:, segment], window)
        found.weights[:, segment] = weights
    turns = found.poses[..., 2]
    c, s = np.cos(turns), np.sin(turns)
    x, y = found.centres.T
    found.poses[..., 0] += c * x - s * y
    found.poses[..., 1] += s * x + c * y
    return found


def _fine(image: Picture, fine_px: float | None) -> Picture:
    """A picture less its blurred self."""
    if fine_px is None:
        return image
    return image - np.asarray(cv2.GaussianBlur(image, (0, 0), fine_px), dtype=np.float32)


def within(starts: Array, before: Array, low: Array) -> Array:
    """Frames (f, 3) of the picture as frames of the kept ones, whose corner is at low (2,) px."""
    offset, c, s = starts[:, :2] - before[:, :2], np.cos(before[:, 2]), np.sin(before[:, 2])
    x = c * offset[:, 0] + s * offset[:, 1] - low[0]
    y = -s * offset[:, 0] + c * offset[:, 1] - low[1]
    return np.column_stack([x, y, starts[:, 2] - before[:, 2]])


def _without(turned: Array, before: Array, window: Window) -> Array:
    """And back."""
    offset, c, s = turned[:, :2] + window.low, np.cos(before[:, 2]), np.sin(before[:, 2])
    x = before[:, 0] + c * offset[:, 0] - s * offset[:, 1]
    y = before[:, 1] + s * offset[:, 0] + c * offset[:, 1]
    return np.column_stack([x, y, turned[:, 2] + before[:, 2]])


def _unfolded(window: Window, segment: int, shape: Silhouette, bends: Array) -> Array:
    """Which points (n,) no fold hides, 0 or 1."""
    slopes = np.tan(0.5 * np.clip(shape.palm * bends, 0.0, 2.4))
    along, depth = window.local[:, 0], np.maximum(shape.palm * window.local[:, 1], 0.0)
    if segment == 0:
        return np.ones(len(along))
    seen = along >= depth * slopes[segment]
    if segment < 3:
        seen &= along <= shape.lengths[segment - 1] - depth * slopes[segment + 1]
    return seen.astype(np.float64)


def _registered(
    images: list[Picture], window: Window, starts: Array, shown: Array
) -> tuple[Array, Array]:
    """Frames (f, 3) at which the pictures show what their mean shows, and weights (f,)."""
    seen = np.stack(
        [
            _flat(sampled(image, _points(start, window.local)), window.light, show)
            for image, start, show in zip(images, starts, shown, strict=True)
        ]
    )
    often = shown.sum(axis=0)
    mean = (shown * seen).sum(axis=0) / np.maximum(often, 1.0)
    shown = shown * (often >= _OFTEN)
    found, weights = starts.copy(), np.zeros(len(starts))
    for number, image in enumerate(images):
        slopes = [cv2.Sobel(image, cv2.CV_32F, *way, scale=0.125) for way in ((1, 0), (0, 1))]
        planes = [image, *(np.asarray(slope, dtype=np.float32) for slope in slopes)]
        share = float(shown[number].mean())
        if share >= _LEAST_SHOWN:
            found[number], moved = _found(planes, mean, window, starts[number], shown[number])
            weights[number] = share if moved < _MARGIN_PX else 0.0
    return found, weights


def _flat(seen: Array, light: Array, shown: Array) -> Array:
    """Skin without what is smooth across it."""
    weighted = light * (shown[:, None] + 1e-3)
    normal = weighted.T @ light + 1e-6 * np.eye(light.shape[1])
    return seen - light @ np.linalg.solve(normal, weighted.T @ seen)


def _found(
    planes: Sequence[Picture], mean: Array, window: Window, start: Array, shown: Array
) -> tuple[Array, float]:
    """The frame (3,) at which one picture shows the mean, and how far that is from the start."""
    frame = start.copy()
    for _ in range(_STEPS):
        points = _points(frame, window.local)
        now, dx, dy = (sampled(plane, points) for plane in planes)
        offset = points - frame[:2]
        turned = dy * offset[:, 0] - dx * offset[:, 1]
        rows = np.column_stack([dx, dy, turned, window.light])
        miss, weights, step = mean - now, shown, np.zeros(rows.shape[1])
        for _ in range(2):
            weighted = rows * weights[:, None]
            normal = weighted.T @ rows + 1e-3 * np.eye(rows.shape[1])
            step = np.linalg.solve(normal, weighted.T @ miss)
            rest = miss - rows @ step
            scale = 1.4826 * float(np.median(np.abs(rest[shown > 0.0]))) + _LEAST_SCALE
            weights = shown * tukey(rest, 4.0 * scale)
        frame = frame + np.clip(step[:3], -_LARGEST, _LARGEST)
    centre = np.stack([_points(one, window.centre[None])[0] for one in (start, frame)])
    return frame, float(np.hypot(*(centre[1] - centre[0])))


def _points(frame: Array, local: Array) -> Array:
    c, s = np.cos(frame[2]), np.sin(frame[2])
    return frame[:2] + local @ np.array([[c, s], [-s, c]])
