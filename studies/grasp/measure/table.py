"""A finger's recording as a flat table that a spreadsheet opens; units in the columns' names. Pure.

Seconds, degrees, and px of the picture (corrected for its lens where that is known); an empty cell
was not measured, and the last column says why.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence

from studies.grasp.measure.joints import BENDING, Seen
from studies.grasp.measure.plane import label
from studies.grasp.measure.recordings import Finding


def table(finding: Finding, pictures: Sequence[Seen]) -> str:
    """CSV, one row a picture."""
    plan, recording = finding
    places = list(dict.fromkeys([*(plan.base or ()), *plan.joints.values()]))
    angles = [angle for angle in BENDING if angle in plan.joints]
    unit = recording.unit
    header = ["frame", "time_s"]
    for angle in angles:
        name = label(plan, angle)
        header += [f"{name}_deg", f"{name}_sigma_deg"]
    header.append("tip_direction_deg")
    for joint in plan.joints:
        name = label(plan, joint)
        header += [f"{name}_along_{unit}", f"{name}_across_{unit}", f"{name}_sigma_{unit}"]
    for place in places:
        header += [f"{place}_x_px", f"{place}_y_px"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*header, "confidence", "note"])
    for frame, seen in zip(recording.frames, pictures, strict=True):
        row: list[object] = [frame.frame, frame.time_s]
        for angle in angles:
            row += [_deg(frame.angles_rad.get(angle)), _deg(frame.angles_sigma_rad.get(angle))]
        row.append(_deg(frame.tip_direction_rad))
        for joint in plan.joints:
            row += [*frame.points.get(joint, ("", "")), frame.points_sigma.get(joint, "")]
        for place in places:
            at = seen.places.get(place)
            row += ["", ""] if at is None else [round(at.x_px, 3), round(at.y_px, 3)]
        writer.writerow([*row, frame.confidence, frame.note])
    return text.getvalue()


def _deg(angle_rad: float | None) -> object:
    return "" if angle_rad is None else round(math.degrees(angle_rad), 4)
