"""How well fitted colours can be told apart: from each other, from skin, from the room.

Pure. What was not in the pictures is not known of.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.colors.fit import Samples, TrainingSet
from services.pi_tracker.colors.pointer import MIN_CELLS
from services.pi_tracker.colors.separation import hue_gap, separation
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.image.chroma import Cells, Mask
from services.pi_tracker.image.hue import Array, mean_hue

# Measured: a pastel ball before a pale wall, followed without one false detection: 4.0 from skin,
# 3.8 from the wall; the simulator's six paints in cluttered light: 4.3 and more. Two dabs of one
# paint: below 1.
COLLIDE, CLOSE = 2.5, 3.5
# Foreign blobs smaller than this are noise that comes and goes: 32 px.
_MIN_FOREIGN_CELLS = 8


@dataclass(frozen=True)
class ColorResult:
    """One colour, and how it stands out."""

    color: str
    cells: int  # of its patches
    pictures: int
    hsv: tuple[int, int, int]  # typical
    inside: float  # share of its patches within the range, mean over the pictures
    skin: float  # d' from skin, -1: none seen
    room_px: int  # the largest foreign blob within the range
    room_at: tuple[int, int, int] | None  # its place: x, y in px, picture
    missed: tuple[int, ...]  # pictures in which it was pointed at, and the range takes nothing
    unseen: tuple[int, ...]  # all other pictures in which the range takes nothing


@dataclass(frozen=True)
class PairResult:
    """Two colours: d' of their samples (-1 where one has none).

    hue_gap is that between their hue ranges (negative: they overlap).
    """

    a: str
    b: str
    separation: float
    hue_gap: int


@dataclass(frozen=True)
class Report:
    """The whole outcome; warnings are for a person."""

    colors: tuple[ColorResult, ...]
    pairs: tuple[PairResult, ...]
    warnings: tuple[str, ...]


def examine(
    training: TrainingSet,
    fitted: Mapping[str, ColorRange],
    known: Mapping[str, ColorRange] | None = None,
) -> Report:
    """Test fitted ranges on the pictures they were fitted to.

    known are the other colours' ranges, of which there are no samples.
    """
    ranges = {**(known or {}), **fitted}
    names = sorted(ranges)
    labels = [_labels(part, ranges, names) for part in training.cells]
    results = tuple(_color(training, color, names.index(color) + 1, labels) for color in fitted)
    pairs = tuple(
        PairResult(a, b, _between(training, a, b), hue_gap(ranges[a], ranges[b]))
        for i, a in enumerate(names)
        for b in names[i + 1 :]
        if a in fitted or b in fitted
    )
    warnings = [text for pair in pairs if (text := _pair_warning(pair, ranges))]
    warnings += [text for result in results for text in _color_warnings(result, training.names)]
    return Report(results, pairs, tuple(warnings))


def _between(training: TrainingSet, a: str, b: str) -> float:
    if a not in training.samples or b not in training.samples:
        return -1.0
    return round(separation(training.samples[a].paint, training.samples[b].paint), 1)


def _labels(cells: Cells, ranges: Mapping[str, ColorRange], names: list[str]) -> Array:
    """The class of every cell (h, w), as the tracker has it."""
    luma = np.clip(cells.y + 16.0, 0, 255).astype(np.uint8)
    chroma = np.stack(
        [np.clip(plane + 128.0, 0, 255).astype(np.uint8) for plane in (cells.u, cells.v)], axis=-1
    )
    return compile_colors(Colors(colors=dict(ranges)), names).classify(
        luma, np.ascontiguousarray(chroma)
    )


def _color(training: TrainingSet, color: str, number: int, labels: list[Array]) -> ColorResult:
    own = training.samples[color]
    hue, saturation, value = own.paint.hsv()
    typical = (
        round(mean_hue(hue, own.paint.chroma)) % 180,
        round(float(np.median(saturation))),
        round(float(np.median(value))),
    )
    inside = [_share_inside(own, labels[k] == number, k) for k in own.frames]
    foreign = [(labels[k] == number) & ~training.covered[k] for k in own.frames]
    blobs = [(*_largest_blob(mask), k) for mask, k in zip(foreign, own.frames, strict=True)]
    cells, x, y, picture = max(blobs)
    is_blob = cells >= _MIN_FOREIGN_CELLS
    missed, unseen = _blind_pictures(training, color, [part == number for part in labels])
    return ColorResult(
        color,
        sum(int(np.count_nonzero(patch.core)) for patch in own.patches),
        len(own.frames),
        typical,
        round(float(np.mean(inside)), 3),
        round(separation(own.paint, own.skin), 1),
        4 * cells if is_blob else 0,
        (x, y, picture) if is_blob else None,
        missed,
        unseen,
    )


def _share_inside(own: Samples, taken: Mask, picture: int) -> float:
    """Share of a colour's patches in one picture that its range takes."""
    return float(np.concatenate([taken[p.core] for p in own.patches if p.frame == picture]).mean())


def _blind_pictures(
    training: TrainingSet, color: str, taken: list[Mask]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Pictures in which a range takes nothing that the tracker would search.

    First those with its patch, or in which it was pointed at in vain, then those in which nobody
    pointed at it.
    """
    missed: list[int] = []
    unseen: list[int] = []
    patches = training.samples[color].patches
    for number, mask in enumerate(taken):
        own = [patch.whole for patch in patches if patch.frame == number]
        # Where there is a patch, what is taken elsewhere is not it.
        seen = mask & np.logical_or.reduce(own) if own else mask
        if _largest_blob(seen)[0] >= MIN_CELLS:
            continue
        (missed if number in training.pointed.get(color, ()) else unseen).append(number)
    return tuple(missed), tuple(unseen)


def _largest_blob(mask: Mask) -> tuple[int, int, int]:
    """Cells of the largest blob after the tracker's erosion and dilation, and its middle in px."""
    element = np.ones((2, 2), np.uint8)
    eroded = cv2.erode(mask.astype(np.uint8), element, anchor=(0, 0))
    opened = cv2.dilate(eroded, element, anchor=(1, 1))
    _, _, stats, centroids = cv2.connectedComponentsWithStats(opened)
    if len(stats) < 2:
        return 0, 0, 0
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    x, y = centroids[largest]
    return int(stats[largest, cv2.CC_STAT_AREA]), round(2.0 * x), round(2.0 * y)


def _pair_warning(pair: PairResult, ranges: Mapping[str, ColorRange]) -> str:
    """Empty if the two can be told apart."""
    a, b = pair.a, pair.b
    if 0.0 <= pair.separation < COLLIDE:
        return (
            f"{a} and {b} collide (d' {pair.separation}): they cannot be told apart; "
            "repaint one of them"
        )
    if 0.0 <= pair.separation < CLOSE:
        return f"{a} and {b} are close (d' {pair.separation}): expect mix-ups in poor light"
    if pair.hue_gap < 0 and _levels_overlap(ranges[a], ranges[b]):
        return (
            f"the ranges of {a} and {b} overlap by {-pair.hue_gap} hues; "
            "point at both together to part them"
        )
    return ""


def _color_warnings(result: ColorResult, names: Sequence[str]) -> list[str]:
    found = [
        f"the range of {result.color} takes nothing in {names[k]}, although {result.color} was "
        "pointed at there; look whether that picture has other light, or point again"
        for k in result.missed
    ]
    found += [
        f"the range of {result.color} takes nothing in {names[k]}; if {result.color} can be seen "
        "there, point at it in that picture, too"
        for k in result.unseen
    ]
    if 0.0 <= result.skin < COLLIDE:
        found.append(
            f"{result.color} is the colour of skin (d' {result.skin}): "
            "fingers will be taken for it; use another paint"
        )
    elif 0.0 <= result.skin < CLOSE:
        found.append(
            f"{result.color} is close to skin (d' {result.skin}): "
            "reflections on fingers may be taken for it"
        )
    if result.room_at is not None:
        x, y, picture = result.room_at
        found.append(
            f"the room has the hue of {result.color}: {result.room_px} px at ({x}, {y}) "
            f"in {names[picture]}; take it away, cover it, or use another paint"
        )
    return found


def _levels_overlap(a: ColorRange, b: ColorRange) -> bool:
    """Whether two ranges share a saturation and a value."""
    return all(max(a.hsv_low[k], b.hsv_low[k]) <= min(a.hsv_high[k], b.hsv_high[k]) for k in (1, 2))


def statistics(report: Report) -> dict[str, Any]:
    """A report for the residuals of a colours file."""
    return {
        "colors": {
            c.color: {
                "inside": c.inside,
                "hsv": list(c.hsv),
                "cells": c.cells,
                "pictures": c.pictures,
                "skin": c.skin,
                "room_px": c.room_px,
            }
            for c in report.colors
        },
        "separation": {
            f"{p.a}/{p.b}": {"d": p.separation, "hue_gap": p.hue_gap} for p in report.pairs
        },
        "warnings": list(report.warnings),
    }


def colors_file(
    report: Report, fitted: Mapping[str, ColorRange], known: Mapping[str, ColorRange], **made: Any
) -> Colors:
    """Fitted ranges beside those of other colours that stay.

    made is date, tool and inputs of the file.
    """
    return Colors(colors={**known, **fitted}, residuals=statistics(report), **made)
