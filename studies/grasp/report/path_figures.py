"""Paths of the tip: the paper's Fig. 6."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from rhot.geometry.transforms import Array
from studies.grasp.cycles.spread import spread
from studies.grasp.planar import joints_of
from studies.grasp.report.study import Person, track_of
from studies.grasp.report.style import (
    BAND,
    MEASURED,
    Drawn,
    legend_above,
    new_figure,
    panels,
    style,
)


class Paths(NamedTuple):
    """Of one person, each from its own start as the paper draws them; NaN where not measured."""

    cycles: list[Array]  # (n, 2) measured tip of each closing
    measured: Array  # (n, 2) their mean, p_m
    fixed: Array  # (n, 2) kinematics of the measured angles with fixed lengths, p_f
    own: Array  # (n, 2) the same with the lengths of each frame, p_v


def paths_of(person: Person) -> Paths:
    """All begin where p_f does."""
    cycles, fixed, own = [], [], []
    count = len(person.sequences[0][1].times_s)
    for recovery, sequence in person.sequences:
        track = track_of(sequence)
        if len(track.times_s) == count:
            cycles.append(track.tip)
            fixed.append(joints_of(track.angles_rad, np.array(recovery.lengths))[:, 3])
            own.append(joints_of(track.angles_rad, track.lengths)[:, 3])
    mean, p_f, p_v = (spread(one).mean for one in (cycles, fixed, own))
    start = _start(p_f) if np.isfinite(p_f).any() else _start(mean)
    shift = start - _start(mean)
    return Paths([one + shift for one in cycles], mean + shift, p_f, p_v + (start - _start(p_v)))


def paths_figure(people: Sequence[Person], number: int) -> Drawn:
    """Fig. 6 of up to six people."""
    rows, columns = panels(len(people))
    figure = new_figure((3.9 * columns + 0.3, 2.7 * rows + 0.6))
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, person in zip(grid.flat, people, strict=False):
        _draw(axes, paths_of(person), person)
    for axes in list(grid.flat)[len(people) :]:
        axes.remove()
    legend_above(figure, grid[0, 0], 4 if columns > 1 else 2)
    return Drawn(
        f"fig6_{number}",
        "Paths of the tip",
        "In the finger's plane: across along the back of the hand, down towards the palm, MCP at"
        " the origin (+). p_m: measured, each closing and their mean; p_f: kinematics of the"
        " measured angles with fixed lengths of the phalanges; p_v: with the lengths of each frame."
        " As the paper's Fig. 6, all curves begin where p_f does (o).",
        figure,
    )


def _draw(axes: Axes, paths: Paths, person: Person) -> None:
    for k, one in enumerate(paths.cycles):
        axes.plot(*one.T, color=BAND, linewidth=0.8, label="p_m, each closing" if k == 0 else None)
    axes.plot(*paths.measured.T, color=MEASURED, linewidth=3.2, label="p_m, mean")
    for label, path, color, dashes in (
        ("p_f, fixed lengths", paths.fixed, "#D55E00", "--"),
        ("p_v, measured lengths", paths.own, "#0072B2", ":"),
    ):
        if np.isfinite(path).all(axis=1).any():
            axes.plot(*path.T, color=color, linestyle=dashes, linewidth=1.7, label=label)
    axes.plot(*_start(paths.measured), "o", color=MEASURED, markersize=5)
    axes.plot(0.0, 0.0, "+", color=MEASURED, markersize=9)
    axes.set_aspect("equal", adjustable="box")
    axes.invert_yaxis()
    style(axes, f"along the hand / {person.unit}", f"to the palm / {person.unit}", person.label)


def _start(path: Array) -> Array:
    """The first measured point (2,) of a path."""
    known = np.isfinite(path).all(axis=1)
    return path[int(np.argmax(known))] if known.any() else np.zeros(2)
