"""What a person reads on a terminal of one recovered recording. Pure."""

from __future__ import annotations

from studies.grasp.recover.errors import MethodError, errors_of
from studies.grasp.recover.result import Recovery


def lines_of(name: str, recovery: Recovery) -> list[str]:
    """Which pieces were found, each method's error with fixed lengths, and the notes."""
    kinds = {sequence.kind for sequence in recovery.sequences}
    several = "s" if len(recovery.sequences) > 1 else ""
    kind = "whole recording" if kinds == {"whole"} else "/".join(sorted(kinds)) + several
    head = (
        f"{name}: {recovery.subject}, {recovery.finger}, {len(recovery.sequences)} {kind},"
        f" lengths {' '.join(f'{one:.1f}' for one in recovery.lengths)} {recovery.unit}"
        f" ({recovery.lengths_from})"
    )
    lines = [head]
    lines += [f"  {_told(one)}" for one in errors_of([recovery]) if one.lengths == "fixed"]
    lines += [f"  note: {note}" for note in recovery.notes]
    lines += [f"  left out: {one}" for one in recovery.incomplete]
    return lines


def _told(one: MethodError) -> str:
    if one.why_not_run:
        return f"{one.method:16} not run: {one.why_not_run}"
    every = one.joints[-1]
    if every.rms is None or every.p95 is None or every.largest is None:
        found = "no measured angles to compare with"
    else:
        found = f"{every.rms:5.2f} deg RMS, 95 % {every.p95:5.2f}, at most {every.largest:5.2f}"
    return (
        f"{one.method:16} {found}; iterations {one.first_iterations} first,"
        f" {one.later_median:.0f} later ({one.later_iterations} at most)"
    )
