"""A finger's recording in a few lines: what was measured, in how many pictures. Pure."""

from __future__ import annotations

import math

import numpy as np

from studies.grasp.measure.joints import BENDING
from studies.grasp.measure.plane import label
from studies.grasp.measure.recordings import Finding

# Of notes on single pictures so many kinds are listed.
_SHOWN = 6


def summary(finding: Finding) -> str:
    """One line an angle, the lengths, then what a person should know."""
    plan, recording = finding
    count = len(recording.frames)
    lines = []
    for joint in BENDING:
        if joint not in plan.joints:
            continue
        frames = [frame for frame in recording.frames if joint in frame.angles_rad]
        if not frames:
            lines.append(f"  {label(plan, joint):4} in none of {count} pictures")
            continue
        degrees = [math.degrees(frame.angles_rad[joint]) for frame in frames]
        sigma = math.degrees(float(np.median([one.angles_sigma_rad[joint] for one in frames])))
        lines.append(
            f"  {label(plan, joint):4} in {len(frames)} of {count} pictures: "
            f"{min(degrees):.1f} to {max(degrees):.1f} degrees, sigma {sigma:.2f}"
        )
    if recording.lengths is not None and recording.lengths_sigma is not None:
        pairs = zip(recording.lengths, recording.lengths_sigma, strict=True)
        texts = ", ".join(f"{length:.2f} (sigma {sigma:.2f})" for length, sigma in pairs)
        lines.append(f"  bones {texts} {recording.unit}")
    lines += [f"  {note}" for note in recording.notes]
    return "\n".join(lines + _frame_notes(finding))


def _frame_notes(finding: Finding) -> list[str]:
    """What happened in single pictures, by kind: how often, and where first."""
    kinds: dict[str, list[int]] = {}
    for frame in finding.recording.frames:
        for note in filter(None, frame.note.split("; ")):
            kinds.setdefault(note, []).append(frame.frame)
    often = sorted(kinds.items(), key=lambda item: -len(item[1]))
    lines = [f"  {note}: {len(at)} pictures, first {at[0]}" for note, at in often[:_SHOWN]]
    if len(often) > _SHOWN:
        lines.append(f"  ... and {len(often) - _SHOWN} kinds of notes more, in the CSV")
    return lines
