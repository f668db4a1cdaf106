"""Recordings in, what each method makes of the path of the tip out. Pure: the clock is given.

Laws of one person are fitted over all closings of theirs, in all their recordings; each closing is
recovered with the law of the *other* ones, so that none predicts itself (where there is only one,
it does, and the notes say so).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from studies.grasp.cycles.sample import PAPER_FRAMES
from studies.grasp.planar import limits_of
from studies.grasp.recording import Angle, GraspRecording
from studies.grasp.recover import result
from studies.grasp.recover.laws import Law, fit_law, joined, law_support
from studies.grasp.recover.methods import METHODS
from studies.grasp.recover.runs import Work, run_method
from studies.grasp.recover.sequences import Part, Piece, Pieces, pieces_of, total_flexion
from studies.grasp.track import FingerTrack, finger_lengths, finger_track, implausible

# Fewer frames than this show no curve; more than this interpolate what was never measured.
MIN_FRAMES, MAX_FRAMES = 5, 1000


class Settings(NamedTuple):
    """How recordings are recovered."""

    part: Part = "closing"
    frames: int = PAPER_FRAMES
    methods: tuple[str, ...] = tuple(METHODS)
    limits_deg: Mapping[Angle, tuple[float, float]] = {}


class Watcher(Protocol):
    """Who is told how much is done of how much, in frames times methods."""

    total: int

    def advance(self, count: int = 1) -> None:
        """So many more are done."""


class _Prepared(NamedTuple):
    """One recording, ready to be recovered."""

    recording: GraspRecording
    track: FingerTrack
    lengths: Array  # (3,)
    lengths_from: str
    limits: Array  # (4, 2)
    pieces: Pieces
    notes: list[str]
    lengths_hold: bool


def check(settings: Settings) -> None:
    """Raises CaptureError."""
    unknown = [name for name in settings.methods if name not in METHODS]
    if unknown:
        raise CaptureError(f"there is no method {unknown[0]!r}; valid: {', '.join(METHODS)}")
    if not MIN_FRAMES <= settings.frames <= MAX_FRAMES:
        raise CaptureError(
            f"--frames {settings.frames}: a closing has {MIN_FRAMES} to {MAX_FRAMES} frames"
            f" of interest; the paper's are {PAPER_FRAMES}"
        )


def recover(
    recordings: Sequence[GraspRecording],
    settings: Settings,
    clock_s: Callable[[], float],
    watcher: Watcher,
) -> Iterator[result.Recovery | CaptureError]:
    """One Recovery for each recording in their order, or why there is none."""
    check(settings)
    prepared = [_tried(recording, settings) for recording in recordings]
    pieces = [p for one in prepared if isinstance(one, _Prepared) for p in one.pieces.found]
    watcher.total = len(settings.methods) * sum(len(piece.track.times_s) for piece in pieces)
    people: dict[tuple[str, str], list[tuple[Array, Array]]] = {}
    for one in prepared:
        if isinstance(one, _Prepared):
            people.setdefault(_person(one.recording), []).extend(_bends(one))
    seen = dict.fromkeys(people, 0)
    for one in prepared:
        if isinstance(one, CaptureError):
            yield one
            continue
        person = _person(one.recording)
        yield _recovered(one, settings, people[person], seen[person], clock_s, watcher)
        seen[person] += len(one.pieces.found)


def _person(recording: GraspRecording) -> tuple[str, str]:
    return recording.subject, recording.finger


def _bends(one: _Prepared) -> list[tuple[Array, Array]]:
    """PIP and DIP of each piece."""
    return [(p.track.angles_rad[:, 1], p.track.angles_rad[:, 2]) for p in one.pieces.found]


def _tried(recording: GraspRecording, settings: Settings) -> _Prepared | CaptureError:
    try:
        return _prepared(recording, settings)
    except CaptureError as error:
        return error


def _prepared(recording: GraspRecording, settings: Settings) -> _Prepared:
    track = finger_track(recording)
    lengths, origin = finger_lengths(recording, track)
    if lengths is None:
        raise CaptureError(
            f"{recording.subject}: neither lengths of the phalanges nor all joints were measured:"
            " a tip's path alone says nothing of angles. Give the recording its `lengths`"
        )
    if not np.isfinite(track.tip).all(axis=1).any():
        raise CaptureError(f"{recording.subject}: no frame has the tip's position; measure it")
    notes = [*recording.notes, *track.notes]
    odd = implausible(recording, lengths)
    if odd:
        notes.append(odd)
    if recording.unit == "px":
        notes.append("nothing in the picture gave a length: distances are px, angles hold")
    if recording.finger == "thumb":
        notes.append("of a thumb mcp, pip, dip are CMC, MCP and IP; DIP = 2/3 PIP is no law of it")
    limits = limits_of(recording.finger, settings.limits_deg)
    flexion = total_flexion(track, lengths, limits)
    pieces = pieces_of(track, flexion, settings.part, settings.frames)
    notes += pieces.notes
    return _Prepared(recording, track, lengths, origin, limits, pieces, notes, not odd)


def _recovered(
    one: _Prepared,
    settings: Settings,
    bends: list[tuple[Array, Array]],
    first: int,
    clock_s: Callable[[], float],
    watcher: Watcher,
) -> result.Recovery:
    """One recording; its pieces are bends[first], bends[first + 1], ... of its person."""
    notes = list(one.notes)
    support = law_support(bends)
    if support is not None and len(bends) == 1:
        notes.append("one closing alone: its own DIP law is fitted to itself")
    degree = 2 if support is not None and support.better == "parabola" else 1
    sequences = [
        _sequence(one, piece, settings, _law_of_others(bends, first + k, degree), clock_s, watcher)
        for k, piece in enumerate(one.pieces.found)
    ]
    limits_deg = np.rad2deg(one.limits[1:])
    return result.Recovery(
        subject=one.recording.subject,
        finger=one.recording.finger,
        unit=one.recording.unit,
        source=one.recording.source,
        lengths_hold=one.lengths_hold,
        lengths=(float(one.lengths[0]), float(one.lengths[1]), float(one.lengths[2])),
        lengths_from=one.lengths_from,
        limits_deg=[(float(low), float(high)) for low, high in limits_deg],
        law=support,
        notes=notes,
        incomplete=one.pieces.incomplete,
        sequences=sequences,
    )


def _sequence(
    one: _Prepared,
    piece: Piece,
    settings: Settings,
    law: Law | None,
    clock_s: Callable[[], float],
    watcher: Watcher,
) -> result.Sequence:
    """One piece by every method."""
    work = Work(
        track=piece.track,
        lengths=one.lengths,
        measured_lengths=piece.track.lengths,
        limits=one.limits,
        law=law,
        doubt=_doubt(one),
        # The paper's damping is in mm or px; a finger in an unknown unit is taken for 80 mm.
        scale=1e-3 if one.lengths_hold else 0.08 / float(one.lengths.sum()),
    )
    runs = []
    for name in settings.methods:
        runs += run_method(name, work, clock_s)
        watcher.advance(len(piece.track.times_s))
    return result.Sequence(
        kind=piece.kind,
        number=piece.number,
        note=piece.note,
        times_s=piece.track.times_s.tolist(),
        columns=[result.numbers(row) for row in piece.track.columns()],
        runs=runs,
    )


def _doubt(one: _Prepared) -> float:
    """Sigma of a finger's fixed lengths together, as a share of them; 0 where nobody says."""
    sigmas = one.recording.lengths_sigma or (0.0, 0.0, 0.0)
    return float(np.linalg.norm(sigmas) / one.lengths.sum())


def _law_of_others(bends: list[tuple[Array, Array]], own: int, degree: int) -> Law | None:
    """The law of all closings but one's own, or its own where there is no other."""
    others = [one for k, one in enumerate(bends) if k != own] or bends
    return fit_law(*joined(others), degree)
