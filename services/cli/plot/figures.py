"""The pictures of `rhot plot`: arrays in, matplotlib figures out.

No pyplot, no global state, no window. Lines break at NaN. A figure without any value is still a
figure: callers leave it out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure

from rhot.geometry.transforms import Array
from rhot.hand import DIGIT_ANGLES, DIGITS
from services.cli.plot.axes import (
    Track,
    color_of,
    draw_sigma,
    label,
    label_xyz,
    new_figure,
    style,
)


def markers_figure(
    camera: str, size_px: tuple[int, int], tracks: Mapping[str, Track], counts: Track
) -> Figure:
    """One camera: x and y of each colour over time, markers per frame, and paths in the image."""
    figure = new_figure(f"markers, camera {camera}", (13.0, 7.5))
    grid = figure.add_gridspec(3, 2, width_ratios=(3, 2), height_ratios=(3, 3, 1))
    count = figure.add_subplot(grid[2, 0])
    x, y = (figure.add_subplot(grid[row, 0], sharex=count) for row in range(2))
    image = figure.add_subplot(grid[:, 1])
    dots: dict[str, Any] = {"marker": ".", "markersize": 2.5}
    for number, (name, track) in enumerate(tracks.items()):
        color = name if is_color_like(name) else color_of(number)
        for axes, column in ((x, 0), (y, 1)):
            axes.plot(track.times_s, track.values[:, column], color=color, linewidth=0.8, **dots)
        image.plot(*track.values.T, color=color, linewidth=0.6, label=name, **dots)
    count.step(counts.times_s, counts.values[:, 0], color="black", linewidth=0.7, where="mid")
    count.set_ylim(-0.2, max(float(np.max(counts.values)), 1.0) + 0.4)
    label(x, "x / px", last=False)
    label(y, "y / px", last=False)
    label(count, "markers", last=True)
    y.invert_yaxis()
    image.set_xlim(-0.5, size_px[0] - 0.5)
    image.set_ylim(size_px[1] - 0.5, -0.5)
    image.set_aspect("equal")
    style(image)
    image.set_title("paths in the image", fontsize=9)
    if tracks:
        image.legend(
            fontsize=8, loc="upper left", bbox_to_anchor=(0.0, -0.06), ncols=4, frameon=False
        )
    return figure


def points_figure(hand: str, tracks: Mapping[str, tuple[Track, npt.NDArray[np.bool_]]]) -> Figure:
    """One hand: x, y, z of each landmark over time, and the paths from the front and from above.

    Each track comes with which of its rows are only predicted (n,): those are drawn as circles.
    """
    title = f"3D points, {hand} hand, rig frame (band: one sigma; circles: predicted)"
    figure = new_figure(title, (13.0, 8.0))
    grid = figure.add_gridspec(1, 2, width_ratios=(3, 2))
    left, right = (figure.add_subfigure(grid[0, column]) for column in range(2))
    over_time = left.subplots(3, 1, sharex=True)
    front, above = right.subplots(2, 1)
    circles: dict[str, Any] = {
        "marker": "o",
        "linestyle": "",
        "markersize": 3.5,
        "markerfacecolor": "none",
    }
    for number, (name, (track, predicted)) in enumerate(tracks.items()):
        color, mm = color_of(number), 1e3 * track.values
        for row, axes in enumerate(over_time):
            axes.plot(track.times_s, mm[:, row], color=color, linewidth=1.0, label=name)
            draw_sigma(axes, track, row, color, 1e3)
            axes.plot(track.times_s[predicted], mm[predicted, row], color=color, **circles)
        front.plot(mm[:, 0], mm[:, 1], color=color, linewidth=0.8)
        above.plot(mm[:, 0], mm[:, 2], color=color, linewidth=0.8)
    label_xyz(over_time, legend_size=7)
    for axes, title, vertical in (
        (front, "from the front", "y / mm"),
        (above, "from above", "z / mm"),
    ):
        axes.set_title(f"{title} (x to the right, mm)", fontsize=9)
        axes.set_ylabel(vertical, fontsize=8)
        axes.set_aspect("equal", adjustable="datalim")
        style(axes)
    front.invert_yaxis()
    return figure


def angles_figure(
    hand: str, estimate: Track, truth: Track | None, limits_deg: Array, *, measured: bool
) -> Figure:
    """One hand: the four angles of each digit in deg, values (n, 20), with sigma; truth dashed.

    limits_deg (20, 2): low and high of each angle, dotted; measured: of this person's hand.
    """
    dashed = "; dashed: truth" if truth is not None else ""
    limits = "limits" if measured else "limits of the tables"
    title = f"joint angles, {hand} hand (band: one sigma; dotted: {limits}{dashed})"
    figure = new_figure(title, (12.0, 11.0))
    rows = figure.subplots(5, 1, sharex=True)
    dashes: dict[str, Any] = {"linewidth": 0.9, "linestyle": "--", "alpha": 0.8}
    for row, (digit, names) in enumerate(zip(DIGITS, DIGIT_ANGLES, strict=True)):
        axes = rows[row]
        for column, name in enumerate(names):
            color, index = color_of(column), 4 * row + column
            values = estimate.values[:, index]
            axes.plot(estimate.times_s, values, color=color, linewidth=1.2, label=name)
            low, high = limits_deg[index]
            # An angle that cannot move has neither.
            if high > low:
                draw_sigma(axes, estimate, index, color)
                for limit in (low, high):
                    axes.axhline(limit, color=color, linewidth=0.8, linestyle=":", alpha=0.7)
            if truth is not None:
                axes.plot(truth.times_s, truth.values[:, index], color=color, **dashes)
        label(axes, f"{digit} / deg", last=row == 4)
        axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def residuals_figure(
    hand: str, residuals: Track, iterations: Array, unsolved: npt.NDArray[np.bool_]
) -> Figure:
    """One hand: the solver's residual per digit in mm (n, 5) and its iterations (n, 5).

    Crosses stand where the status is not "solved", unsolved (n, 5).
    """
    figure = new_figure(f"solver, {hand} hand", (12.0, 7.0))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for row, digit in enumerate(DIGITS):
        color, values, flagged = color_of(row), residuals.values[:, row], unsolved[:, row]
        above.plot(residuals.times_s, values, color=color, linewidth=1.0, label=digit)
        above.plot(residuals.times_s[flagged], values[flagged], "x", color=color, markersize=4.5)
        below.plot(residuals.times_s, iterations[:, row], color=color, linewidth=0.8)
    label(above, "residual / mm (x: not solved)", last=False)
    label(below, "iterations", last=True)
    above.legend(fontsize=8, ncols=5, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False)
    return figure
