"""A comparison as figures, tables and pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np

from studies.grasp.compare import figures
from studies.grasp.compare.band import Leaving
from studies.grasp.compare.comparison import Comparison, JudgedPerson
from studies.grasp.compare.markers import fewest
from studies.grasp.report.pages import Picture, Report, Section, written_report
from studies.grasp.report.tables import Table, number

# Sets of markers in a page's table; the file has all.
_SHOWN = 14


def write_comparison(
    found: Comparison,
    out: Path,
    title: str,
    about: str,
    wanted_deg: float,
    notes: Mapping[str, Sequence[str]],
) -> list[Path]:
    """Write everything; the files written, the HTML first."""
    drawn = [
        figures.paths_figure(found),
        figures.deviation_figure(found),
        figures.distances_figure(found),
        figures.markers_figure(found),
    ]
    pictures = [None if one is None else one.picture() for one in drawn]
    markers = markers_table(found)
    band: list[Table | Picture | None] = [leaving_table(found), pictures[0], pictures[1]]
    shapes: list[Table | Picture | None] = [pictures[2], lag_table(found)]
    shown = markers._replace(rows=markers.rows[:_SHOWN])
    sections = [
        Section("The band, and who leaves it", found.why_no_band, _there(band)),
        Section("Shapes", "", _there(shapes)),
        Section("Markers", markers_answer(found, wanted_deg), _there([shown, pictures[3]])),
    ]
    report = Report(title, about, sections, notes)
    numbers = msgspec.json.encode(_numbers(found), enc_hook=np.ndarray.tolist)
    return written_report(report, out, "compare", numbers, [markers])


def markers_answer(found: Comparison, wanted_deg: float) -> str:
    """The smallest set for the wanted accuracy, in words."""
    best = fewest(found.choices, wanted_deg)
    if best is None:
        return f"No set of the measured markers reaches {wanted_deg:g} deg in every joint."
    return (
        f"For {wanted_deg:g} deg RMS in every joint, {len(best.markers)} marker"
        f"{'s' if len(best.markers) > 1 else ''} will do: {' + '.join(best.markers)} (worst joint"
        f" {best.worst_deg:.1f} deg)."
    )


def leaving_table(found: Comparison) -> Table | None:
    """Where each judged recording leaves the band of the path and of each joint."""
    if found.band is None:
        return None
    rows = [row for one in found.judged for row in _leavings(one)]
    return Table(
        "leaving",
        f"Outside the band of {found.band.references} references",
        ["recording", "what", "from / %", "to / %", "furthest", "unit", "times the half width"],
        rows,
        "Per cent of the mean closing. The path's distance is in per cent of the finger's length;"
        " positive lies on the side away from the knuckle. A newcomer of the references' kind"
        f" leaves the band in one of {found.band.references + 1} recordings or so.",
    )


def lag_table(found: Comparison) -> Table:
    """Distances and lag from the references' mean, one a person."""
    rows = []
    for k, one in enumerate(found.people):
        others = [j for j in range(found.references) if j != k]
        if others:
            rows.append(
                [
                    one.subject,
                    "reference" if k < found.references else "judged",
                    number(100.0 * float(found.procrustes[k, others].mean()), 1),
                    number(100.0 * float(found.warping[k, others].mean()), 1),
                    number(100.0 * float(found.lag[k, others].mean()), 1),
                    number(one.recordings[0].length, 1),
                    one.recordings[0].unit,
                ]
            )
    return Table(
        "shapes",
        "Distance from the references, means",
        ["person", "as", "Procrustes / %", "warped / %", "later by / %", "finger", "unit"],
        rows,
        "Distances in per cent of the finger's length, the lag in per cent of the closing.",
    )


def markers_table(found: Comparison) -> Table:
    """All sets of markers, the fewest first."""
    rows = [
        [
            " + ".join(one.markers),
            str(len(one.markers)),
            *(number(value, 2) for value in one.found_deg),
            number(one.found_p95_deg, 2),
            number(one.found_max_deg, 1),
            *(number(value, 2) for value in one.predicted_deg),
        ]
        for one in found.choices
    ]
    direction_deg = np.rad2deg(found.noise.direction_rad)
    header = ["markers", "n", "MCP", "PIP", "DIP", "95 %", "max"]
    header += ["predicted: MCP", "PIP", "DIP"]
    return Table(
        "markers",
        "RMS error by markers, deg",
        header,
        rows,
        "Against the angles of all markers, and predicted from noise: a marker is seen to"
        f" {100 * found.noise.point:.2f} % of the finger's length (one standard deviation along"
        f" each axis), the direction of the tip to {direction_deg:.1f} deg. That direction takes a"
        " second dot on the distal phalanx, or its edge.",
    )


def _leavings(one: JudgedPerson) -> list[list[str]]:
    name = one.someone.subject
    rows = [_leaving(name, "path", leaving, "%", 100.0) for leaving in one.shape.leavings]
    for joint, leavings in one.joints.items():
        rows += [_leaving(name, joint.upper(), leaving, "deg", 1.0) for leaving in leavings]
    return rows or [[name, "nothing: inside everywhere", "", "", "", "", ""]]


def _leaving(name: str, what: str, one: Leaving, unit: str, factor: float) -> list[str]:
    start, end = number(100.0 * one.start, 0), number(100.0 * one.end, 0)
    return [name, what, start, end, number(factor * one.furthest, 1), unit, number(one.widths, 1)]


def _there(parts: Sequence[Table | Picture | None]) -> list[Table | Picture]:
    return [one for one in parts if one is not None]


def _numbers(found: Comparison) -> dict[str, object]:
    """For other programs; NaN is null."""
    return {
        "people": [one.subject for one in found.people],
        "references": found.references,
        "procrustes": found.procrustes.tolist(),
        "warping": found.warping.tolist(),
        "lag": found.lag.tolist(),
        "band": None if found.band is None else found.band._asdict(),
        "judged": [
            {
                "subject": one.someone.subject,
                "outside_share": one.shape.outside_share,
                "path": [leaving._asdict() for leaving in one.shape.leavings],
                "joints": {k: [v._asdict() for v in own] for k, own in one.joints.items()},
            }
            for one in found.judged
        ],
        "why_no_band": found.why_no_band,
        "markers": [one._asdict() for one in found.choices],
    }
