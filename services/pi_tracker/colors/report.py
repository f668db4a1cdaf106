"""How well fitted colours can be told apart: from each other, from skin, from the room; and what a
person should be warned of. Pure.

Separation is d', the distance of two clouds of chroma over luma in units of their spread (Fisher's
discriminant): at 6 a bound half way misjudges one cell in 700, at 4 one in 40, at 2 one in 6.
Shading does not change it. What was not in the pictures is not known of.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.colors.fit import Study
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.image.chroma import Array, Cells, Mask, hue_apart, mean_hue

# Measured: a pastel ball before a pale wall, followed without one false detection: 4.0 from skin,
# 3.8 from the wall; the simulator's six paints in cluttered light: 4.3 and more. Two dabs of one
# paint: below 1.
COLLIDE, CLOSE = 2.5, 3.5
# Fewer cells than this say nothing about a cloud.
_FEW = 8
# Foreign blobs smaller than this are noise that comes and goes: 32 px.
_THING_CELLS = 8
# Tails left out of a cloud's spread, and the least spread there is: rounding of chroma at mid luma.
_TAIL, _LEAST_SPREAD = 0.02, 0.004


@dataclass(frozen=True)
class ColorResult:
    """One colour: its patches, its separation from skin (-1: none seen), and the largest foreign
    blob in its range (px; x, y, picture).
    """

    color: str
    cells: int
    pictures: int
    hsv: tuple[int, int, int]
    inside: float
    skin: float
    room_px: int
    room_at: tuple[int, int, int] | None


@dataclass(frozen=True)
class PairResult:
    """Two colours: d' of their samples (-1 where one has none) and the gap between their hue ranges
    (negative: they overlap).
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


def separation(a: Cells, b: Cells) -> float:
    """d' of two clouds of cells, -1 if one has too few."""
    if a.y.size < _FEW or b.y.size < _FEW:
        return -1.0
    one, other = _trimmed(a.tint), _trimmed(b.tint)
    apart = np.median(one, axis=0) - np.median(other, axis=0)
    spread = (np.cov(one.T) + np.cov(other.T)) / 2.0 + np.eye(2) * _LEAST_SPREAD**2
    return float(np.sqrt(apart @ np.linalg.solve(spread, apart)))


def _trimmed(tint: Array) -> Array:
    low, high = np.quantile(tint, [_TAIL, 1.0 - _TAIL], axis=0)
    return np.clip(tint, low, high)


def hue_gap(a: ColorRange, b: ColorRange) -> int:
    """Hue steps between two ranges, 0 if they touch, negative by how much they overlap."""
    widths = [(span.hsv_high[0] - span.hsv_low[0]) % 180 for span in (a, b)]
    middles = [span.hsv_low[0] + width / 2.0 for span, width in zip((a, b), widths, strict=True)]
    apart = abs(hue_apart(middles[0], middles[1]))
    return round(apart - (widths[0] + widths[1]) / 2.0)


def examine(
    study: Study, fitted: Mapping[str, ColorRange], known: Mapping[str, ColorRange] | None = None
) -> Report:
    """Judge fitted ranges by the pictures they were fitted to.

    Known are the other colours' ranges, of which there are no samples.
    """
    everything = {**(known or {}), **fitted}
    names = sorted(everything)
    labels = [_labels(part, everything, names) for part in study.cells]
    results = tuple(_color(study, color, names.index(color) + 1, labels) for color in fitted)
    pairs = tuple(
        PairResult(a, b, _between(study, a, b), hue_gap(everything[a], everything[b]))
        for i, a in enumerate(names)
        for b in names[i + 1 :]
        if a in fitted or b in fitted
    )
    return Report(results, pairs, tuple(_warnings(results, pairs, everything)))


def _between(study: Study, a: str, b: str) -> float:
    if a not in study.samples or b not in study.samples:
        return -1.0
    return round(separation(study.samples[a].paint, study.samples[b].paint), 1)


def _labels(cells: Cells, ranges: Mapping[str, ColorRange], names: list[str]) -> Array:
    """The class of every cell, as the tracker has it."""
    luma = np.clip(cells.y + 16.0, 0, 255).astype(np.uint8)
    chroma = np.stack(
        [np.clip(plane + 128.0, 0, 255).astype(np.uint8) for plane in (cells.u, cells.v)], axis=-1
    )
    return compile_colors(Colors(colors=dict(ranges)), names).classify(
        luma, np.ascontiguousarray(chroma)
    )


def _color(study: Study, color: str, number: int, labels: list[Array]) -> ColorResult:
    own = study.samples[color]
    hue, saturation, value = own.paint.hsv()
    typical = (
        round(mean_hue(hue, own.paint.chroma)) % 180,
        round(float(np.median(saturation))),
        round(float(np.median(value))),
    )
    inside = [labels[swatch.frame][swatch.core] == number for swatch in own.swatches]
    blobs = [(*_largest((labels[k] == number) & ~study.covered[k]), k) for k in own.frames]
    cells, x, y, picture = max(blobs)
    return ColorResult(
        color,
        int(own.paint.y.size),
        len(own.frames),
        typical,
        round(float(np.concatenate(inside).mean()), 3),
        round(separation(own.paint, own.skin), 1),
        4 * cells if cells >= _THING_CELLS else 0,
        (x, y, picture) if cells >= _THING_CELLS else None,
    )


def _largest(mask: Mask) -> tuple[int, int, int]:
    """Cells of the largest connected patch after the tracker's erosion and dilation, and its middle
    in px.
    """
    kernel = np.ones((2, 2), np.uint8)
    opened = cv2.dilate(
        cv2.erode(mask.astype(np.uint8), kernel, anchor=(0, 0)), kernel, anchor=(1, 1)
    )
    _, _, stats, middles = cv2.connectedComponentsWithStats(opened)
    if len(stats) < 2:
        return 0, 0, 0
    best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return (
        int(stats[best, cv2.CC_STAT_AREA]),
        round(2.0 * middles[best][0]),
        round(2.0 * middles[best][1]),
    )


def _warnings(
    results: tuple[ColorResult, ...],
    pairs: tuple[PairResult, ...],
    ranges: Mapping[str, ColorRange],
) -> list[str]:
    found = []
    for pair in pairs:
        if 0.0 <= pair.separation < COLLIDE:
            found.append(
                f"{pair.a} and {pair.b} collide (d' {pair.separation}): they cannot be told apart; repaint one of them"
            )
        elif 0.0 <= pair.separation < CLOSE:
            found.append(
                f"{pair.a} and {pair.b} are close (d' {pair.separation}): expect mix-ups in poor light"
            )
        elif pair.hue_gap < 0 and _levels_meet(ranges[pair.a], ranges[pair.b]):
            found.append(
                f"the ranges of {pair.a} and {pair.b} overlap by {-pair.hue_gap} hues; point at both together to part them"
            )
    for result in results:
        if 0.0 <= result.skin < COLLIDE:
            found.append(
                f"{result.color} is the colour of skin (d' {result.skin}): fingers will be taken for it; use another paint"
            )
        elif 0.0 <= result.skin < CLOSE:
            found.append(
                f"{result.color} is close to skin (d' {result.skin}): reflections on fingers may be taken for it"
            )
        if result.room_at is not None:
            x, y, picture = result.room_at
            found.append(
                f"the room has the hue of {result.color}: {result.room_px} px at ({x}, {y}) in picture {picture + 1}; "
                "take it away, cover it, or use another paint"
            )
    return found


def _levels_meet(a: ColorRange, b: ColorRange) -> bool:
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

    Made is date, tool and inputs of the file.
    """
    return Colors(colors={**known, **fitted}, residuals=statistics(report), **made)
