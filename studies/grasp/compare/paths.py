"""Each recording's path of the tip, and its joints' curves: means over its closings. Pure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from studies.grasp.cycles.spread import spread
from studies.grasp.planar import limits_of
from studies.grasp.recording import GraspRecording
from studies.grasp.recover.sequences import pieces_of, total_flexion
from studies.grasp.track import FingerTrack, finger_lengths, finger_track

# Frames of a path: enough for a curve without corners, few enough to be paired one by one.
FRAMES = 61


class TipPath(NamedTuple):
    """One recording."""

    name: str
    subject: str
    finger: str
    path: Array  # (FRAMES, 2) mean over closings, divided by the finger's length
    closings: list[Array]  # each (FRAMES, 2)
    angles_deg: Array  # (FRAMES, 3) mean over closings, NaN where not measured
    length: float  # of the finger, the recording's unit
    unit: str
    tracks: list[FingerTrack]  # of the closings, sampled
    lengths: Array  # (3,)
    notes: list[str]


def tip_path(name: str, recording: GraspRecording) -> TipPath:
    """Raises CaptureError where no closing was found, or no lengths."""
    track = finger_track(recording)
    lengths, _ = finger_lengths(recording, track)
    if lengths is None:
        raise CaptureError(
            f"{name}: neither lengths of the phalanges nor all joints were measured; a path is"
            " compared in lengths of its finger"
        )
    limits = limits_of(recording.finger, {})
    flexion = total_flexion(track, lengths, limits)
    pieces = pieces_of(track, flexion, "closing", FRAMES)
    if any(piece.kind == "whole" for piece in pieces.found):
        raise CaptureError(f"{name}: {pieces.notes[0].split('. ')[0]}; a shape needs a closing")
    total = float(lengths.sum())
    closings = [_whole(piece.track.tip / total) for piece in pieces.found]
    known = [one for one in closings if one is not None]
    if not known:
        raise CaptureError(f"{name}: no closing has the tip's path without a gap")
    return TipPath(
        name=name,
        subject=recording.subject,
        finger=recording.finger,
        path=spread(known).mean,
        closings=known,
        angles_deg=np.rad2deg(spread([piece.track.angles_rad for piece in pieces.found]).mean),
        length=total,
        unit=recording.unit,
        tracks=[piece.track for piece in pieces.found],
        lengths=lengths,
        notes=pieces.notes + pieces.incomplete,
    )


def _whole(path: Array) -> Array | None:
    """A path whose unmeasured frames, at most a tenth, are bridged; None with more."""
    known = np.isfinite(path).all(axis=1)
    if known.mean() < 0.9:
        return None
    frames = np.arange(len(path))
    return np.column_stack([np.interp(frames, frames[known], path[known, k]) for k in (0, 1)])
