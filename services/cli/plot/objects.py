"""The picture of objects: where each was over time, and how far off beside the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rhot.geometry.transforms import Array
from rhot.messages.objects import ObjectPose
from rhot.messages.simulator import Truth
from services.cli.evaluate.score_statistics import turns_deg
from services.cli.evaluate.truth_track import ObjectTrack, inside, object_track
from services.cli.plot.axes import (
    Track,
    color_of,
    draw_sigma,
    label,
    label_xyz,
    new_figure,
    with_gaps,
)

_DASHES: dict[str, Any] = {"color": "black", "linewidth": 0.8, "linestyle": "--"}


@dataclass(frozen=True, eq=False)
class Drawing:
    """One object: positions in mm, those that were not ok, its truth, and what is between them.

    off (n, 2) is the distance in mm and the turn in deg of poses that are ok.
    """

    position: Track
    unsure: Track
    truth: Track | None = None
    off: Track | None = None


def drawings(
    poses: Sequence[ObjectPose], truth: Sequence[Truth], origin_ns: int
) -> dict[str, Drawing]:
    """What is drawn of each object, without the poses in which it was lost."""
    found = {}
    for name in sorted({pose.object for pose in poses}):
        own = [pose for pose in poses if pose.object == name and pose.tracking != "lost"]
        own.sort(key=lambda pose: pose.stamp_ns)
        if own:
            known = any(name in line.objects for line in truth)
            found[name] = _drawing(own, object_track(truth, name) if known else None, origin_ns)
    return found


def _drawing(poses: Sequence[ObjectPose], truth: ObjectTrack | None, origin_ns: int) -> Drawing:
    stamps = np.array([pose.stamp_ns for pose in poses], dtype=np.int64)
    times_s = np.asarray((stamps - origin_ns) * 1e-9, dtype=np.float64)
    position_mm: Array = 1e3 * np.array([pose.position_m for pose in poses])
    good = np.array([pose.registered and pose.tracking == "ok" for pose in poses])
    sigma_mm = [np.nan if pose.sigma_m is None else 1e3 * pose.sigma_m for pose in poses]
    sigma = np.repeat(np.array(sigma_mm)[:, None], 3, axis=1)  # (n, 3)
    position = with_gaps(Track(times_s, position_mm, sigma))
    unsure = Track(times_s[~good], position_mm[~good])
    if truth is None:
        return Drawing(position, unsure)
    true_times_s = np.asarray((truth.stamps_ns - origin_ns) * 1e-9, dtype=np.float64)
    true_position = Track(true_times_s, 1e3 * truth.position_m)
    within = inside(truth, stamps) & good
    if not within.any():
        return Drawing(position, unsure, true_position)
    real = truth.at(stamps[within])
    off_mm = np.linalg.norm(position_mm[within] - 1e3 * real.position_m, axis=1)
    wxyz = np.array([pose.orientation_wxyz for pose in poses])[within]
    off = np.stack([off_mm, turns_deg(wxyz, real.orientation_wxyz)], axis=1)  # (n, 2)
    return Drawing(position, unsure, true_position, with_gaps(Track(times_s[within], off)))


def objects_figure(objects: Mapping[str, Drawing]) -> Figure:
    """Position over time, truth dashed, poses that are not ok as circles; errors below."""
    compared = any(one.off is not None for one in objects.values())
    title = "objects, rig frame (band: one sigma; circles: not ok, or not registered"
    title += "; dashed: truth)" if any(one.truth for one in objects.values()) else ")"
    figure = new_figure(title, (12.0, 10.0 if compared else 7.0))
    rows = figure.subplots(5 if compared else 3, 1, sharex=True)
    for number, (name, one) in enumerate(objects.items()):
        _positions(rows[:3], name, one, color_of(number))
        if one.off is not None:
            for axes, values in zip(rows[3:], one.off.values.T, strict=True):
                axes.plot(one.off.times_s, values, color=color_of(number), linewidth=0.8)
    label_xyz(rows[:3], legend_size=8)
    if compared:
        label(rows[2], "z / mm", last=False)
        label(rows[3], "off / mm", last=False)
        label(rows[4], "turned / deg", last=True)
    return figure


def _positions(rows: npt.NDArray[np.object_], name: str, one: Drawing, color: str) -> None:
    axes: Axes
    for row, axes in enumerate(rows):
        line = one.position
        axes.plot(line.times_s, line.values[:, row], color=color, linewidth=1.0, label=name)
        draw_sigma(axes, line, row, color)
        circles = one.unsure.values[:, row]
        axes.plot(
            one.unsure.times_s, circles, "o", color=color, markersize=3.5, markerfacecolor="none"
        )
        if one.truth is not None:
            axes.plot(one.truth.times_s, one.truth.values[:, row], **_DASHES)
