"""The tables of a report. Pure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from studies.grasp.recover.errors import MethodError, errors_of
from studies.grasp.recover.methods import METHODS
from studies.grasp.recover.result import array
from studies.grasp.report.motion_range import person_range
from studies.grasp.report.study import Person, angles_of, track_of
from studies.grasp.report.tables import Table, joined, mean_sd, number

_JOINT_NAMES = {"mcp": "MCP", "pip": "PIP", "dip": "DIP", "all": "all joints"}


def people_table(people: Sequence[Person]) -> Table:
    """Who was recorded, and what was found in the recordings."""
    rows = []
    for person in people:
        for name, recording, recovery in person.entries:
            kinds = [one.kind for one in recovery.sequences]
            times = [one.times_s[-1] - one.times_s[0] for one in recovery.sequences]
            totals = [angles_of(one)[0].sum(axis=1) for one in recovery.sequences]
            ranges = [float(np.rad2deg(np.nanmax(one) - np.nanmin(one))) for one in totals]
            rows.append(
                [
                    person.label,
                    name,
                    "" if recording is None else recording.method,
                    joined(recovery.lengths),
                    person.unit,
                    f"{len(kinds)} {kinds[0]}{'s' if len(kinds) > 1 else ''}",
                    mean_sd((float(np.mean(times)), _sd(times)), 1),
                    mean_sd((float(np.mean(ranges)), _sd(ranges))),
                    str(len(recovery.incomplete)),
                ]
            )
    header = ["person", "recording", "by", "phalanges", "unit", "found", "seconds", "flexion / deg"]
    return Table(
        "recordings",
        "Recordings",
        [*header, "left out"],
        rows,
        "seconds and flexion (of the three joints together) of each that was found, mean ± SD; a"
        " fist flexes by 200 to 270 deg.",
    )


def motion_table(people: Sequence[Person]) -> Table:
    """Active range of motion."""
    rows, sources = [], set()
    for person in people:
        found = person_range(person)
        if found is None:
            continue
        sources.add(found.source)
        rows += [
            [
                person.label,
                _JOINT_NAMES[joint.joint],
                mean_sd(joint.extension),
                mean_sd(joint.flexion),
                mean_sd(joint.arc),
                joint.neutral_zero,
                str(joint.closings),
                found.source,
            ]
            for joint in found.joints
        ]
        rows.append(
            [
                person.label,
                "TAM",
                "",
                "",
                mean_sd(found.total_active),
                "",
                str(found.joints[0].closings),
                found.source,
            ]
        )
    return Table(
        "range_of_motion",
        "Active range of motion, deg (mean ± SD over closings)",
        ["person", "joint", "extension", "flexion", "arc", "neutral-zero", "n", "angles"],
        rows,
        "Extension is the smallest angle of a closing (negative: beyond straight), flexion the"
        " largest. Neutral-zero: extension-0-flexion; 0-15-90 lacks 15 deg to straight. TAM, total"
        " active motion: the three flexions minus what is missing to straight."
        + ("" if sources <= {"measured"} else " Where angles name a method, none were measured."),
    )


def error_table(people: Sequence[Person], lengths: str, title: str) -> Table | None:
    """Each method against the measured angles; None where nothing ran so."""
    found = [
        one
        for one in errors_of([e.recovery for person in people for e in person.entries])
        if one.lengths == lengths
    ]
    if not any(one.frames for one in found):
        return None
    rows = [
        [one.method, *(_sizes(joint.rms, joint.p95, joint.largest) for joint in one.joints)]
        for one in found
        if not one.why_not_run
    ]
    left_out = [f"{one.method}: {one.why_not_run}" for one in found if one.why_not_run]
    note = f"Not run: {'; '.join(left_out)}." if left_out else ""
    if all(one.joints[-1].rms is None for one in found):
        note = f"No angles were measured: there is nothing to compare with. {note}".strip()
    header = ["method", *(_JOINT_NAMES[joint.joint] for joint in found[0].joints)]
    return Table(f"errors_{lengths}", f"{title}: RMS / 95 % / maximum, deg", header, rows, note)


def all_errors_table(people: Sequence[Person]) -> Table:
    """Every error, one a row, for other programs; a file only."""
    groups = [("everybody", [e.recovery for person in people for e in person.entries])]
    groups += [(person.label, [e.recovery for e in person.entries]) for person in people]
    rows = [
        [
            label,
            one.method,
            one.lengths,
            joint.joint,
            *(number(v, 3) for v in (joint.rms, joint.mean, joint.p95, joint.largest)),
            str(one.frames),
        ]
        for label, recoveries in groups
        for one in errors_of(recoveries)
        if not one.why_not_run
        for joint in one.joints
    ]
    header = ["person", "method", "lengths", "joint", "rms_deg", "mean_deg", "p95_deg", "max_deg"]
    return Table("errors", "Errors", [*header, "frames"], rows)


def _sizes(*values: float | None) -> str:
    return " / ".join(number(one, 1) for one in values) if values[0] is not None else ""


def effort_table(people: Sequence[Person]) -> Table:
    """Iterations, convergence, limits and time."""
    found = errors_of([e.recovery for person in people for e in person.entries])
    units = {person.unit for person in people}
    rows = [_effort(one) for one in found if one.lengths == "fixed" and not one.why_not_run]
    unit = units.pop() if len(units) == 1 else "?"
    header = ["method", "frames", "first", "later: median", "95 %", "max", "not reached"]
    header += ["at a limit", f"left / {unit}", "ms"]
    return Table(
        "iterations",
        "Iterations and convergence, fixed lengths",
        header,
        rows,
        "first: the worst first frame, from [0, 90, 0, 0] deg as the paper starts; later: every"
        " other frame, from the angles of the one before. closed-form counts refinements of its one"
        " unknown, fabrik passes and the iterations of the solver that it hands over to. not"
        " reached: frames whose tip is not where it was measured; at a limit: frames that end at"
        " one of MCP / PIP / DIP; left: RMS distance from tip to target; ms: of computing, a"
        " frame.",
    )


def _effort(one: MethodError) -> list[str]:
    return [
        one.method,
        str(one.frames),
        str(one.first_iterations),
        number(one.later_median, 0),
        number(one.later_p95, 0),
        str(one.later_iterations),
        str(one.unreached),
        " / ".join(map(str, one.at_limit)),
        number(one.left_rms, 3),
        number(1e3 * one.seconds_a_frame, 2),
    ]


def person_error_table(people: Sequence[Person]) -> Table:
    """RMS of each method for each person, joint by joint."""
    rows = []
    for person in people:
        for one in errors_of([entry.recovery for entry in person.entries]):
            if one.lengths == "fixed" and one.joints[-1].rms is not None:
                rms = [number(joint.rms, 2) for joint in one.joints]
                rows.append([person.label, one.method, *rms, number(one.joints[-1].largest, 1)])
    return Table(
        "errors_by_person",
        "RMS error by person, deg, fixed lengths",
        ["person", "method", "MCP", "PIP", "DIP", "all joints", "max"],
        rows,
    )


def law_table(people: Sequence[Person]) -> Table:
    """DIP against PIP: line, parabola, and 2/3."""
    rows = []
    for person in people:
        law = person.entries[0].recovery.law
        if law is None:
            continue
        a, b, _ = law.line.coefficients
        d, e, f = law.parabola.coefficients
        rows.append(
            [
                person.label,
                f"{np.rad2deg(a):.1f} + {b:.3f} PIP",
                f"{np.rad2deg(d):.1f} + {e:.3f} PIP + {np.deg2rad(f):.5f} PIP²",
                number(law.line.unseen_rms_deg or law.line.rms_deg, 2),
                number(law.parabola.unseen_rms_deg or law.parabola.rms_deg, 2),
                number(law.parabola.aicc - law.line.aicc, 0),
                number(law.parabola.bic - law.line.bic, 0),
                f"{law.f_test_p:.1g}",
                law.better,
                f"{law.two_thirds_rms_deg:.1f} / {law.two_thirds_max_deg:.1f}",
            ]
        )
    header = ["person", "line, deg", "parabola, deg", "line, RMS of unseen", "parabola, likewise"]
    header += ["ΔAICc", "ΔBIC", "F test, p", "better", "2/3 PIP, RMS / max"]
    return Table(
        "dip_pip",
        "How DIP follows PIP",
        header,
        rows,
        "RMS of unseen: each closing predicted by the law fitted to the others, deg; that decides."
        " ΔAICc, ΔBIC (parabola minus line) and the F test take every frame for a witness of its"
        " own, and find a parabola nearly always.",
    )


def method_table() -> Table:
    """What each method uses."""
    rows = [[name, method.about] for name, method in METHODS.items()]
    return Table("methods", "Methods", ["method", "what it uses"], rows)


def angles_table(people: Sequence[Person]) -> Table:
    """Every frame's measured and recovered angles, for other programs; a file only."""
    rows = []
    for person in people:
        for number_, (_, sequence) in enumerate(person.sequences, start=1):
            tables = [("measured", "", track_of(sequence).angles_rad)]
            tables += [
                (run.method, run.lengths, array(run.angles_rad))
                for run in sequence.runs
                if not run.why_not_run
            ]
            for method, lengths, angles in tables:
                for k, row in enumerate(np.rad2deg(angles)):
                    start = [person.label, str(number_), sequence.kind, str(k + 1)]
                    time_s = f"{sequence.times_s[k]:.4f}"
                    rows.append([*start, time_s, method, lengths, *(number(v, 3) for v in row)])
    header = ["person", "sequence", "kind", "frame", "time_s", "method", "lengths"]
    return Table("angles", "Angles", [*header, "mcp_deg", "pip_deg", "dip_deg"], rows)


def _sd(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
