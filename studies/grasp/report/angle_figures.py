"""Joint angles over the frames of a closing: the paper's Fig. 5, people together, iterations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.cycles.spread import spread
from studies.grasp.recover.result import Sequence as Frames
from studies.grasp.recover.result import array
from studies.grasp.report.study import Person, angles_of, run_of, track_of
from studies.grasp.report.style import (
    BAND,
    MEASURED,
    Drawn,
    color_of,
    legend_above,
    method_line,
    new_figure,
    safe_name,
    style,
)

_JOINTS = ("MCP", "PIP", "DIP")


def angles_figure(person: Person, number: int) -> Drawn:
    """Fig. 5 of one person: means over closings, methods against measured, and their errors."""
    sequences = _alike(person)
    measured = np.rad2deg([track_of(one).angles_rad for one in sequences])
    has_angles = bool(np.isfinite(measured).any())
    figure = new_figure((11.0, 6.4 if has_angles else 3.9))
    grid = figure.subplots(2 if has_angles else 1, 3, squeeze=False, sharex=True)
    frames = np.arange(1, measured.shape[1] + 1)
    for k, joint in enumerate(_JOINTS):
        if has_angles:
            own = spread(list(measured[:, :, k]))
            low, high = own.mean - np.nan_to_num(own.sd), own.mean + np.nan_to_num(own.sd)
            grid[0, k].fill_between(frames, low, high, color=BAND, linewidth=0, label="± SD")
            grid[0, k].plot(frames, own.mean, color=MEASURED, linewidth=2.6, label="measured")
        for method, angles in _methods(sequences):
            line = method_line(method)
            mean = spread(list(angles[:, :, k])).mean
            grid[0, k].plot(frames, mean, label=method, **line)
            if has_angles:
                off = spread(list(angles[:, :, k] - measured[:, :, k])).mean
                grid[1, k].plot(frames, off, **line)
        style(grid[0, k], "" if has_angles else "frame", f"{joint} flexion / deg", joint)
        if has_angles:
            grid[1, k].axhline(0.0, color=MEASURED, linewidth=0.8)
            style(grid[1, k], "frame", "recovered - measured / deg")
    legend_above(figure, grid[0, 0], 9)
    count = f"{len(sequences)} {sequences[0].kind}{'s' if len(sequences) > 1 else ''}"
    what = "Above the angles" if has_angles else "The angles (none were measured)"
    errors = "; below what each method errs by, on the average" if has_angles else ""
    return Drawn(
        f"fig5_{number}_{safe_name(person.label)}",
        f"Joint angles, {person.label}",
        f"{what}, means over {count}{errors}. Fixed lengths of the phalanges. As the paper's Fig."
        " 5; closed-form, dls-position and fabrik share the law DIP = 2/3 PIP and nearly coincide.",
        figure,
    )


def people_figure(people: Sequence[Person]) -> Drawn:
    """Each person's mean angles, and mean and spread over people."""
    figure = new_figure((11.0, 3.9))
    grid = figure.subplots(1, 3)
    curves = [
        spread([np.rad2deg(angles_of(one)[0]) for _, one in person.sequences]).mean
        for person in people
    ]
    frames = np.arange(1, len(curves[0]) + 1)
    together = spread(curves)
    for k, joint in enumerate(_JOINTS):
        if len(people) > 1:
            mean, sd = together.mean[:, k], np.nan_to_num(together.sd[:, k])
            band = (mean - sd, mean + sd)
            grid[k].fill_between(frames, *band, color=BAND, linewidth=0, label="± SD over people")
            grid[k].plot(frames, mean, color=MEASURED, linewidth=2.6, label="mean over people")
        for number, (person, curve) in enumerate(zip(people, curves, strict=True)):
            color = color_of(number)
            grid[k].plot(frames, curve[:, k], color=color, linewidth=1.1, label=person.label)
        style(grid[k], "frame", f"{joint} flexion / deg", joint)
    legend_above(figure, grid[0], 8)
    return Drawn(
        "people",
        "All people",
        "Each person's mean over closings; mean and standard deviation of these means over people.",
        figure,
    )


def iterations_figure(people: Sequence[Person]) -> Drawn | None:
    """Iterations of each frame, median and most over all closings; None where none ran."""
    sequences = [one for person in people for _, one in person.sequences]
    figure = new_figure((8.0, 3.9))
    axes = figure.subplots()
    drawn = False
    for method in ("dls-1", "dls-2", "dls", "dls-position", "fabrik"):
        runs = [run for one in sequences if (run := run_of(one, method)) is not None]
        if not runs:
            continue
        counts = np.array([run.iterations for run in runs], dtype=float)
        frames, line = np.arange(1, counts.shape[1] + 1), method_line(method)
        axes.plot(frames, np.median(counts, axis=0), label=f"{method}, median", **line)
        most = counts.max(axis=0)
        axes.plot(frames, most, "^", color=line["color"], markersize=3.5, label=f"{method}, most")
        drawn = True
    axes.set_xlim(0.0, None)
    axes.set_yscale("symlog", linthresh=10.0)
    axes.set_yticks([0, 2, 4, 6, 8, 10, 20, 50, 100, 200])
    axes.set_yticklabels(["0", "2", "4", "6", "8", "10", "20", "50", "100", "200"])
    axes.set_ylim(0.0, max(float(axes.get_ylim()[1]), 12.0))
    style(axes, "frame", "iterations")
    legend_above(figure, axes, 5)
    caption = (
        "Iterations until the tip is reached: the first frame starts from [0, 90, 0, 0] deg, each"
        " later one from the angles of the one before (linear up to 10, logarithmic above)."
    )
    return Drawn("iterations", "Iterations", caption, figure) if drawn else None


def _alike(person: Person) -> list[Frames]:
    """A person's sequences that have as many frames as the first."""
    sequences = [one for _, one in person.sequences]
    return [one for one in sequences if len(one.times_s) == len(sequences[0].times_s)]


def _methods(sequences: Sequence[Frames]) -> list[tuple[str, Array]]:
    """Angles (sequences, n, 3) in deg of each method that ran, fixed lengths."""
    names = dict.fromkeys(run.method for one in sequences for run in one.runs)
    found = []
    for name in names:
        runs = [run for one in sequences if (run := run_of(one, name)) is not None]
        if len(runs) == len(sequences):
            found.append((name, np.rad2deg([array(run.angles_rad) for run in runs])))
    return found
