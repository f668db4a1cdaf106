"""Colours, lines and axes that all figures of a report share. No pyplot, no window."""

from __future__ import annotations

import io
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from studies.grasp.report.pages import Picture

# Okabe and Ito's colours, which colour-blind readers can tell apart too; each line has a dash of
# its own besides, so that a print in grey can be read.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MEASURED = "#000000"
BAND = "#b8b8b8"
_DPI = 110
_METHOD_LINES: dict[str, dict[str, Any]] = {
    "closed-form": {"color": "#D55E00", "linestyle": "--"},
    "closed-form-own": {"color": "#E69F00", "linestyle": (0, (5, 1, 1, 1))},
    "dls-1": {"color": "#56B4E9", "linestyle": "-."},
    # Wide: dls, whose goal is the same, lies on it.
    "dls-2": {"color": "#CC79A7", "linestyle": "-", "linewidth": 3.2},
    "dls": {"color": "#0072B2", "linestyle": "-"},
    "dls-position": {"color": "#009E73", "linestyle": (0, (3, 1))},
    "fabrik": {"color": "#7a5230", "linestyle": ":"},
}


class Drawn(NamedTuple):
    """A figure with the name of its file, its title and what it shows."""

    name: str
    title: str
    caption: str
    figure: Figure

    def picture(self) -> Picture:
        """As PNG."""
        stream = io.BytesIO()
        FigureCanvasAgg(self.figure).print_png(stream)
        return Picture(self.name, self.title, self.caption, stream.getvalue())


def method_line(name: str) -> dict[str, Any]:
    """How a method's line is drawn."""
    return {"linewidth": 1.4, **_METHOD_LINES.get(name, {"color": "#444444"})}


def color_of(number: int) -> str:
    """The colour of the n-th person or cycle."""
    return PALETTE[number % len(PALETTE)]


def new_figure(size_in: tuple[float, float]) -> Figure:
    """An empty figure; inches."""
    return Figure(figsize=size_in, dpi=_DPI, layout="constrained")


def style(axes: Axes, across: str = "", up: str = "", title: str = "") -> None:
    """Labels, grid, small digits."""
    axes.set_xlabel(across, fontsize=9)
    axes.set_ylabel(up, fontsize=9)
    if title:
        axes.set_title(title, fontsize=9.5)
    axes.grid(visible=True, linewidth=0.3)
    axes.tick_params(labelsize=8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def legend_above(figure: Figure, axes: Axes, columns: int) -> None:
    """One legend for all axes, outside of them, so that it covers no line."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(
            handles, labels, loc="outside upper center", ncols=columns, fontsize=8.5, frameon=False
        )


def panels(count: int) -> tuple[int, int]:
    """Rows and columns for so many panels, three to a row at most."""
    columns = min(count, 3)
    return -(-count // columns), columns


def safe_name(text: str) -> str:
    """Part of a file name."""
    kept = "".join(one if one.isascii() and (one.isalnum() or one in "-_") else "-" for one in text)
    return kept[:60] or "person"
