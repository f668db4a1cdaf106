"""DIP against PIP: the paper's Fig. 7."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from studies.grasp.planar import TWO_THIRDS
from studies.grasp.recover.laws import Law
from studies.grasp.report.study import Person, track_of
from studies.grasp.report.style import (
    Drawn,
    color_of,
    legend_above,
    new_figure,
    panels,
    style,
)

# A shape for each closing.
_MARKS = ("o", "s", "^", "v", "D", "P", "X")


def laws_figure(people: Sequence[Person], number: int) -> Drawn | None:
    """Fig. 7 of up to six people; None where nobody's DIP and PIP were measured."""
    people = [one for one in people if one.entries[0].recovery.law is not None]
    if not people:
        return None
    rows, columns = panels(len(people))
    figure = new_figure((3.7 * columns + 0.4, 3.5 * rows + 0.7))
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, person in zip(grid.flat, people, strict=False):
        _draw(axes, person)
    for axes in list(grid.flat)[len(people) :]:
        axes.remove()
    legend_above(figure, grid[0, 0], 4 if columns > 1 else 2)
    return Drawn(
        f"fig7_{number}",
        "DIP against PIP",
        "Each mark is a frame, each shape a closing. The law that predicts closings left out of its"
        " fit better is named above each panel (deg RMS of line and parabola). As the paper's Fig."
        " 7.",
        figure,
    )


def _draw(axes: Axes, person: Person) -> None:
    law = person.entries[0].recovery.law
    if law is None:
        return
    pips = []
    for k, (_, sequence) in enumerate(person.sequences):
        angles = np.rad2deg(track_of(sequence).angles_rad)
        pips.append(angles[:, 1])
        look: dict[str, Any] = {"color": "#9a9a9a", "markersize": 3.2, "markerfacecolor": "none"}
        mark = _MARKS[k % len(_MARKS)]
        axes.plot(angles[:, 1], angles[:, 2], mark, label="measured" if k == 0 else None, **look)
    low, high = float(np.nanmin(np.concatenate(pips))), float(np.nanmax(np.concatenate(pips)))
    pip = np.deg2rad(np.linspace(low, high, 60))
    for label, coefficients, number, dashes in (
        ("line", law.line.coefficients, 0, "-"),
        ("parabola", law.parabola.coefficients, 1, "--"),
        ("2/3 PIP", (0.0, TWO_THIRDS, 0.0), 2, ":"),
    ):
        dip = Law(coefficients, (pip[0], pip[-1])).dip(pip)
        line: dict[str, Any] = {"color": color_of(number), "linestyle": dashes, "linewidth": 1.8}
        axes.plot(np.rad2deg(pip), np.rad2deg(dip), label=label, **line)
    unseen = [one.unseen_rms_deg or one.rms_deg for one in (law.line, law.parabola)]
    title = f"{person.label}: {law.better} ({unseen[0]:.2f} / {unseen[1]:.2f})"
    style(axes, "PIP flexion / deg", "DIP flexion / deg", title)
