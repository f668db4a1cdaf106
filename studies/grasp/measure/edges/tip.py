"""Where a finger ends: the circle in its round end, from all pictures together. Pure.

A click in one picture says that roughly: a pixel is 2 % of the last bone and 1 deg of its turn.
Laid over each other along the last bone, all pictures show the fingertip's outline sharply, as what
lies behind it moves, and shading does. The tip is the middle of the round end, as far from the end
as from the sides (there dots are painted, and the centroid of the paper's region A4 is inside of
the fingertip, too), or the outermost point of the outline: whichever was clicked.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from studies.grasp.measure.edges.contrast import Picture, tukey
from studies.grasp.measure.edges.segments import Array
from studies.grasp.measure.edges.silhouette import Silhouette
from studies.grasp.measure.edges.skin.patches import starts_of, within

# The picture kept of a fingertip reaches so many half widths beyond the click and to either side,
# and further by what a followed finger may be off, px.
_REACH, _ASIDE, _MARGIN_PX = 1.6, 1.4, 6.0
# An edge of so many levels a pixel counts fully, as along the outline (contrast.py); kept as bytes.
_CLEAR, _BYTES = 15.0, 17.0
# The circle is fitted to rays within so many rad of the last bone: a quarter turn to each side.
# Error of its middle along the bone, subjects 1, 3, 5 and three people more, 15 sets of clicks,
# px RMS and largest: 0.6 and 1.3, 0.7 and 2.3, 0.6 and 1.6, 0.5 and 1.2, 0.5 and 0.9 with 1.0, 1.2,
# 1.4, 1.57, 1.7; across it 0.4, 0.2, 0.1, 0.1, 0.1. The last bone: 1.2 % RMS, 2.2 % at most.
_ARC, _RAYS = 0.5 * np.pi, 25
# Circles that are tried, in half widths: how far from the click the middle is along the bone and
# across it, and radii.
_ALONG, _ACROSS, _RADII = (-1.3, 0.3), 0.35, (0.6, 1.4)
_ROUNDS, _LIMIT_PX, _STEP_PX = 8, 3.0, 0.25
# It is seen if this share of the rays has an edge of so many levels, the fit's misfit is at most
# so many px RMS (found: all of them, 0.1 to 0.3 px) and it is no smaller or larger than tried.
_LEAST_SEEN, _FAINT, _WORST_PX = 0.7, 2.0, 1.0
# What was clicked within this share of the radius of the middle or the end is meant to be there.
# A click of 1 px, seen from a bone that was clicked as badly, is up to 3.8 px off, radii are 13 px
# and more.
_MEANT = 0.4
# The DIP joint is known across the last bone to so many px (0.2 to 0.65 palmwards), so the middle
# turns the bone only by what is beyond that. DIP's error with those clicks, deg RMS and largest of
# one recording: 1.63 and 2.9 as clicked; 1.44 and 2.6, 1.26 and 2.4, 1.21 and 2.2, 1.22 and 2.1
# with 0, 0.3, 0.6, 1 px; with 0.6 no recording is worse by more than 0.1.
_DIP_PX = 0.6

Kept = npt.NDArray[np.uint8]


class TipWindow(NamedTuple):
    """The part of the last bone's frame that is kept: low (2,) px, columns along and rows across;
    half: of the fingertip's width, px; click: how far along the bone it is.
    """

    low: Array
    size: tuple[int, int]
    half: float
    click: float


class RoundEnd(NamedTuple):
    """The circle: middle (2,) px in the last bone's frame, radius px."""

    middle: Array
    radius: float


class Tip(NamedTuple):
    """place (2,) px in the last bone's frame; how it was found, in words."""

    place: Array
    note: str


def tip_window(shape: Silhouette) -> TipWindow:
    """What is kept about the tip of a silhouette as it was learned."""
    length = float(shape.lengths[2])
    half = float(np.mean([shape.distances[shape.sides[3, side][-1]] for side in (-1, 1)]))
    reach = np.array([_REACH, _ASIDE]) * half + _MARGIN_PX
    width, height = (np.ceil(2.0 * reach) + 1.0).astype(int)
    low = np.floor(np.array([length, 0.0]) - reach)
    return TipWindow(low, (int(width), int(height)), half, length)


def tip_kept(colours: Picture, window: TipWindow, shape: Silhouette, vector: Array) -> Kept:
    """How strong edges are about the tip at a pose; colours (h, w, 3) as colours_of has them."""
    seen = _warped(colours, starts_of(shape, vector)[3], window)
    slopes = [cv2.Sobel(seen, cv2.CV_32F, *way, scale=0.125) for way in ((1, 0), (0, 1))]
    size = np.sqrt(np.square(np.stack(slopes)).sum(axis=0).mean(axis=-1))
    return np.asarray(_BYTES * np.minimum(size, _CLEAR), dtype=np.uint8)


def _warped(image: Picture, frame: Array, window: TipWindow) -> Picture:
    """A picture as the window has it at a frame (3,): origin px, turn rad."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    turn = np.array([[c, -s], [s, c]])
    into = np.column_stack([turn, frame[:2] + turn @ window.low])
    flags, border = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, cv2.BORDER_REPLICATE
    seen = cv2.warpAffine(image, into, window.size, flags=flags, borderMode=border)
    return np.asarray(seen, dtype=np.float32)


def round_end(
    kept: Sequence[Kept],
    window: TipWindow,
    followed: tuple[Silhouette, Array],
    now: tuple[Silhouette, Array],
) -> RoundEnd | None:
    """The round end; None where none is seen. followed: shape and poses (f, 6) at which pictures
    were kept; now: those that are known better.
    """
    before = np.stack([starts_of(followed[0], vector)[3] for vector in followed[1]])
    starts = np.stack([starts_of(now[0], vector)[3] for vector in now[1]])
    mean: Picture = np.zeros(window.size[::-1], np.float32)
    for one, frame in zip(kept, within(starts, before, window.low), strict=True):
        mean += _warped(one.astype(np.float32), frame, window)
    mean /= _BYTES * len(kept)
    return _fitted(mean, window)


def _fitted(strength: Picture, window: TipWindow) -> RoundEnd | None:
    """The circle along which edges are strongest; strength (h, w) levels a pixel."""
    turns = np.linspace(-_ARC, _ARC, _RAYS)
    rays = np.column_stack([np.cos(turns), np.sin(turns)])
    circle = _strongest(strength, window, rays)
    rows = np.column_stack([rays, np.ones(_RAYS)])
    offsets = np.arange(-_LIMIT_PX, _LIMIT_PX + _STEP_PX, _STEP_PX)
    seen, misfit = 0.0, np.inf
    for _ in range(_ROUNDS):
        height = _along(strength, window, rays, circle, circle[2] + offsets)
        at = np.clip(np.argmax(height, axis=0), 1, len(offsets) - 2)
        before, here, after = (height[at + step, np.arange(_RAYS)] for step in (-1, 0, 1))
        curve = np.minimum(before - 2.0 * here + after, -1e-6)
        # The vertex of the parabola through the strongest and its neighbours.
        miss = offsets[at] + _STEP_PX * np.clip(0.5 * (before - after) / curve, -1.0, 1.0)
        weights = tukey(np.clip(miss, -_LIMIT_PX, _LIMIT_PX), _LIMIT_PX) * (here > _FAINT)
        normal = rows.T @ (weights[:, None] * rows) + 1e-6 * np.eye(3)
        step = np.linalg.solve(normal, rows.T @ (weights * miss))
        rest = miss - rows @ step
        circle = circle + np.clip(step, -_LIMIT_PX, _LIMIT_PX)
        seen = float((weights > 0.0).mean())
        misfit = float(np.sqrt((weights * rest**2).sum() / max(weights.sum(), 1e-9)))
    usual = _RADII[0] * window.half <= circle[2] <= _RADII[1] * window.half
    if seen < _LEAST_SEEN or misfit > _WORST_PX or not usual:
        return None
    return RoundEnd(circle[:2], float(circle[2]))


def _strongest(strength: Picture, window: TipWindow, rays: Array) -> Array:
    """Of all circles (3,) - middle, radius - the one with most edge all along it, to a pixel."""
    half, logs = window.half, np.log1p(strength)
    radii = np.arange(_RADII[0] * half, _RADII[1] * half, 1.0)
    best, most = np.array([window.click, 0.0, half]), -np.inf
    for x in np.arange(_ALONG[0] * half, _ALONG[1] * half, 1.0):
        for y in np.arange(-_ACROSS * half, _ACROSS * half, 1.0):
            middle = np.array([window.click + x, y, 0.0])
            found = _along(logs, window, rays, middle, radii).mean(axis=1)
            if found.max() > most:
                radius = float(radii[int(np.argmax(found))])
                best, most = np.array([*middle[:2], radius]), found.max()
    return best


def _along(
    plane: Picture, window: TipWindow, rays: Array, circle: Array, distances: Array
) -> Array:
    """A plane of the window at distances (d,) along rays (r, 2) from a circle's middle, (d, r)."""
    points = circle[:2] - window.low + distances[:, None, None] * rays
    # Not bilinear: that has its peaks at pixels, up to 0.3 px off.
    x, y = (np.ascontiguousarray(points[..., way], np.float32) for way in (0, 1))
    seen = cv2.remap(plane, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen, dtype=np.float64)


def tip_of(clicked: Array, end: RoundEnd | None) -> Tip:
    """The tip that a click (2,) in the last bone's frame means. Where it means no place that is
    seen it says how far along the bone it is; all pictures know the bone's turn better.
    """
    as_clicked = clicked * (1.0, 0.0)
    if end is None:
        return Tip(as_clicked, "where it was clicked; no round end is seen in all pictures")
    x, y = end.middle
    middle = np.array([x, np.sign(y) * max(abs(y) - _DIP_PX, 0.0)])
    outermost = middle * (1.0 + end.radius / float(np.hypot(*middle)))
    for place, what in ((middle, "the middle of the round end"), (outermost, "the very end")):
        if np.hypot(*(clicked - place)) <= _MEANT * end.radius:
            return Tip(place, f"{what} of the finger, as all pictures show it")
    off = float(np.hypot(*(clicked - end.middle)))
    return Tip(
        as_clicked,
        f"where it was clicked, {off:.0f} px from the middle of the round end, whose radius is "
        f"{end.radius:.0f} px; click there or on the very end to have it measured in all pictures",
    )
