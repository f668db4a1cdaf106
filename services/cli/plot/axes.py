"""What all pictures of `rhot plot` share: colours, axes over time, and signals to draw on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rhot.geometry.transforms import Array

# Okabe and Ito's colours, which colour-blind readers can tell apart too.
_PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_DPI = 110
_BACKGROUND = "#f2f2f2"
# A gap of more than this many usual steps breaks the line.
_GAP_STEPS = 2.5


@dataclass(frozen=True, eq=False)
class Track:
    """A sampled signal; sigma is one standard deviation of its values, None where unknown."""

    times_s: Array  # (n,)
    values: Array  # (n, k)
    sigma: Array | None = None  # (n, k)


def with_gaps(track: Track) -> Track:
    """The track with a NaN row in each gap, so that its line breaks there."""
    steps_s = np.diff(track.times_s)
    if not len(steps_s):
        return track
    gaps = np.flatnonzero(steps_s > _GAP_STEPS * max(float(np.median(steps_s)), 1e-9)) + 1
    return Track(
        np.insert(track.times_s, gaps, track.times_s[gaps - 1]),
        np.insert(track.values, gaps, np.nan, axis=0),
        None if track.sigma is None else np.insert(track.sigma, gaps, np.nan, axis=0),
    )


def draw_sigma(axes: Axes, track: Track, column: int, color: str, scale: float = 1.0) -> None:
    """A band of one standard deviation about a signal, where it is known; scale of both."""
    if track.sigma is not None:
        middle, sigma = scale * track.values[:, column], scale * track.sigma[:, column]
        axes.fill_between(
            track.times_s, middle - sigma, middle + sigma, color=color, alpha=0.18, linewidth=0.0
        )


def color_of(number: int) -> str:
    """The colour of the n-th line."""
    return _PALETTE[number % len(_PALETTE)]


def new_figure(title: str, size_in: tuple[float, float]) -> Figure:
    """An empty figure with its title; size in inches."""
    figure = Figure(figsize=size_in, dpi=_DPI, layout="constrained")
    figure.suptitle(title, fontsize=11)
    return figure


def label_xyz(rows: npt.NDArray[np.object_], legend_size: int) -> None:
    """Labels of three axes, x, y and z in mm over time, and a legend above the first."""
    for row, axes in enumerate(rows):
        label(axes, f"{'xyz'[row]} / mm", last=row == 2)
    rows[0].legend(
        fontsize=legend_size, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, frameon=False
    )


def label(axes: Axes, vertical: str, *, last: bool) -> None:
    """Label one of several axes over time; the last one has the time below it."""
    axes.set_ylabel(vertical, fontsize=8)
    if last:
        axes.set_xlabel("time / s", fontsize=8)
    else:
        axes.tick_params(labelbottom=False)
    style(axes)


def style(axes: Axes) -> None:
    """Grid, small digits, grey background."""
    axes.grid(visible=True, linewidth=0.3)
    axes.tick_params(labelsize=8)
    axes.set_facecolor(_BACKGROUND)
