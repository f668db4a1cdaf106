"""The frames of a recording that are recovered: its closings, N frames each. Pure.

Where no closing was found, the whole recording is one sequence of its own frames, and says so:
what can be computed of it is.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.cycles.find import Cycle, find_cycles
from studies.grasp.cycles.sample import sampled
from studies.grasp.planar import TWO_THIRDS
from studies.grasp.recover.closed_form import solve_with_law
from studies.grasp.recover.laws import Law
from studies.grasp.track import FingerTrack

Part = Literal["closing", "opening", "whole"]
PARTS: tuple[Part, ...] = ("closing", "opening", "whole")


class Piece(NamedTuple):
    """Frames to recover one after the other."""

    kind: Part
    number: int  # from 1
    note: str
    track: FingerTrack


class Pieces(NamedTuple):
    """What a recording has of them."""

    found: list[Piece]
    incomplete: list[str]
    notes: list[str]


def total_flexion(track: FingerTrack, lengths: Array, limits: Array) -> Array:
    """The sum of the three flexions (n,), for finding closings.

    Measured where the direction of the tip is; else the closed form's with DIP = 2/3 PIP, which
    is 10 deg off at worst and moves as the finger does.
    """
    if np.isfinite(track.direction_rad).mean() > 0.5:
        return track.direction_rad
    law = Law((0.0, TWO_THIRDS, 0.0), (0.0, np.pi))
    total, angles = np.full(len(track.times_s), np.nan), np.zeros(3)
    for k in np.flatnonzero(np.isfinite(track.tip).all(axis=1)).tolist():
        angles = solve_with_law(lengths, limits, law, track.tip[k], angles, np.inf)[0]
        total[k] = angles.sum()
    return total


def pieces_of(track: FingerTrack, flexion_rad: Array, part: Part, count: int) -> Pieces:
    """The pieces of that kind with `count` frames each."""
    if part == "whole":
        return Pieces([Piece("whole", 1, "", track)], [], [])
    cycles, why = find_cycles(track.times_s, flexion_rad)
    own = [cycle for cycle in cycles if cycle.kind == part]
    complete = [cycle for cycle in own if not cycle.incomplete]
    left_out = [_told(cycle) for cycle in own if cycle.incomplete]
    if not own:
        reason = why or f"the finger never {'closes' if part == 'closing' else 'opens'} in it"
        note = f"no {part} found: {reason}. The whole recording is taken as it is"
        return Pieces([Piece("whole", 1, note, track)], [], [note])
    notes = []
    if not complete:
        notes.append(f"no complete {part} found; the incomplete ones are taken")
        complete, left_out = own, []
    found = [
        Piece(part, k, _note(cycle), sampled(track, cycle.start_s, cycle.end_s, count))
        for k, cycle in enumerate(complete, start=1)
    ]
    sparse = sum(cycle.frames < 0.5 * count for cycle in complete)
    if sparse:
        notes.append(
            f"{sparse} of {len(complete)} {part}s have fewer than half of {count} measured frames:"
            " those between are interpolated"
        )
    return Pieces(found, left_out, notes)


def _told(cycle: Cycle) -> str:
    return f"{cycle.kind} at {cycle.start_s:.2f} to {cycle.end_s:.2f} s: {cycle.incomplete}"


def _note(cycle: Cycle) -> str:
    said = [cycle.incomplete] if cycle.incomplete else []
    if cycle.pause_s:
        said.append(f"it pauses for {cycle.pause_s:.1f} s")
    return "; ".join(said)
