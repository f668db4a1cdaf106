"""Figures of a comparison."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rhot.geometry.transforms import Array
from studies.grasp.compare.comparison import Comparison
from studies.grasp.compare.markers import Choice
from studies.grasp.recording import ANGLES
from studies.grasp.report.style import (
    BAND,
    MEASURED,
    Drawn,
    color_of,
    legend_above,
    new_figure,
    style,
)

_MARKS = ("--", ":", "-.", (0, (5, 1, 1, 1)))


def paths_figure(found: Comparison) -> Drawn:
    """All paths with the band, and who was judged."""
    figure = new_figure((7.5, 4.9))
    axes = figure.subplots()
    if found.band is not None:
        out = found.band.normal * found.band.half_width[:, None]
        edge = np.concatenate([found.band.mean + out, (found.band.mean - out)[::-1]])
        axes.fill(*edge.T, color=BAND, alpha=0.75, linewidth=0, label="band of the references")
        axes.plot(*found.band.mean.T, color=MEASURED, linewidth=2.4, label="their mean")
    for k, one in enumerate(found.people):
        is_reference = k < found.references
        line: dict[str, Any] = {"color": color_of(k), "linewidth": 1.0 if is_reference else 2.2}
        axes.plot(*one.path.T, label=one.subject, linestyle=_dashes(found, k), **line)
    axes.plot(0.0, 0.0, "+", color=MEASURED, markersize=9)
    axes.set_aspect("equal", adjustable="box")
    axes.invert_yaxis()
    style(axes, "along the hand / finger lengths", "to the palm / finger lengths")
    legend_above(figure, axes, 5)
    return Drawn(
        "paths",
        "Paths of the tip, in lengths of the finger",
        "Means over closings, each divided by the length of its finger; MCP at the origin (+). The"
        " band is where a newcomer of the references' kind is expected along the whole way; who is"
        " judged is drawn thick and dashed.",
        figure,
    )


def deviation_figure(found: Comparison) -> Drawn | None:
    """How far from the references' mean, along the closing."""
    if found.band is None or not found.judged:
        return None
    joints = [name for name in ANGLES if name in found.joint_bands]
    columns = min(1 + len(joints), 2)
    rows = -(-(1 + len(joints)) // columns)
    figure = new_figure((4.4 * columns + 0.3, 3.0 * rows + 0.7))
    grid = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes in grid[1 + len(joints) :]:
        axes.remove()
    share = np.linspace(0.0, 100.0, len(found.band.mean))
    _banded(grid[0], share, np.zeros(len(share)), found.band.half_width)
    for k, one in enumerate(found.judged, start=found.references):
        line: dict[str, Any] = {"color": color_of(k), "linestyle": _dashes(found, k)}
        grid[0].plot(share, one.shape.deviation, linewidth=2.0, label=one.someone.subject, **line)
        for axes, joint in zip(grid[1:], joints, strict=False):
            angles = one.someone.angles_deg[:, ANGLES.index(joint)]
            axes.plot(share, angles, linewidth=2.0, **line)
    style(grid[0], "closing / %", "beside the mean path / finger lengths", "path (pace removed)")
    for axes, joint in zip(grid[1:], joints, strict=False):
        band = found.joint_bands[joint]
        _banded(axes, share, band.mean, band.half_width)
        style(axes, "closing / %", f"{joint.upper()} flexion / deg", joint.upper())
    legend_above(figure, grid[0], 6)
    return Drawn(
        "deviation",
        "Where a recording leaves the band",
        "First: distance from the references' mean path along its normal, over the mean closing."
        " Then each joint's angle over the closing, with the references' mean and band; pace"
        " counts there.",
        figure,
    )


def distances_figure(found: Comparison) -> Drawn:
    """Procrustes and warping distances of everybody from everybody."""
    names = [one.subject for one in found.people]
    size = 1.6 + 0.55 * max(len(names), 3)
    figure = new_figure((2.0 * size + 1.2, size))
    for axes, title, values in zip(
        figure.subplots(1, 2),
        ("Procrustes (turned, shifted)", "dynamic time warping (pace removed)"),
        (found.procrustes, found.warping),
        strict=True,
    ):
        _matrix(axes, 100.0 * values, names)
        axes.set_title(title, fontsize=9.5)
    return Drawn(
        "distances",
        "How alike paths are",
        "RMS distance of two people's paths in per cent of the finger's length.",
        figure,
    )


def markers_figure(found: Comparison) -> Drawn | None:
    """The best set of each size, joint by joint."""
    if not found.choices:
        return None
    best: dict[int, Choice] = {}
    for one in found.choices:
        best.setdefault(len(one.markers), one)
    figure = new_figure((8.5, 4.2))
    axes = figure.subplots()
    places = np.arange(len(best), dtype=float)
    for k, joint in enumerate(ANGLES):
        x = places + 0.25 * (k - 1)
        found_deg = [one.found_deg[k] for one in best.values()]
        axes.bar(x, found_deg, 0.22, color=color_of(k), label=f"{joint.upper()}, found")
        noise = [one.predicted_deg[k] for one in best.values()]
        label = "predicted from noise and what is not seen" if k == 0 else None
        axes.plot(x, noise, "_", color=MEASURED, markersize=11, markeredgewidth=2, label=label)
    axes.set_xticks(places)
    axes.set_xticklabels([f"{n}: {' + '.join(one.markers)}" for n, one in best.items()])
    axes.tick_params(axis="x", labelrotation=12)
    style(axes, "markers", "RMS error / deg")
    legend_above(figure, axes, 4)
    return Drawn(
        "markers",
        "Markers that a finger needs",
        "The best set of each size. Bars: against the angles of all markers; dashes: predicted from"
        " the noise of the markers, from how far DIP may be from 2/3 PIP, and from a knuckle known"
        " to 3.5 % of the finger where it has no marker.",
        figure,
    )


def _dashes(found: Comparison, k: int) -> Any:
    return "-" if k < found.references else _MARKS[(k - found.references) % len(_MARKS)]


def _banded(axes: Axes, across: Array, mean: Array, half_width: Array) -> None:
    low, high = mean - half_width, mean + half_width
    axes.fill_between(across, low, high, color=BAND, alpha=0.75, linewidth=0, label="band")
    axes.plot(across, mean, color=MEASURED, linewidth=2.0, label="references' mean")


def _matrix(axes: Axes, values: Array, names: list[str]) -> None:
    axes.imshow(values, cmap="cividis", vmin=0.0)
    for (row, column), value in np.ndenumerate(values):
        color = "black" if value > 0.6 * values.max() else "white"
        axes.text(column, row, f"{value:.1f}", ha="center", va="center", color=color, fontsize=8)
    axes.set_xticks(range(len(names)), names, rotation=45, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
