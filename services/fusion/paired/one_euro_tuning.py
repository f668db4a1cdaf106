"""What 1-Euro settings suit a recording: jitter of its still stretch against error in its fast one.

Casiez et al., CHI 2012: first mincutoff for a calm rest, then beta for little lag. Here all pairs
of a grid are tried, and for each degree of calm the one with the least error in motion is kept.
Gaps in a track are bridged by their time step, as the live filter does. A recording without two
seconds at rest, or without one in motion, is a CaptureError that says what to record.
"""

from __future__ import annotations

from typing import NamedTuple

import msgspec
import numpy as np

from rhot.errors import CaptureError
from services.fusion.paired.filter_quality import (
    jitter_m,
    lag_s,
    motion_error_m,
    motion_speed_m_s,
    one_euro_path,
    reference_path,
)
from services.fusion.paired.recorded_tracks import Track, seconds_of

# Grids: from what makes a hand swim to what does nothing, a step of about 1.5.
CUTOFFS_HZ = np.geomspace(0.2, 20.0, 13)
BETAS = np.geomspace(2.0, 1000.0, 13)
# Degrees of calm that the table shows, as a share of the unfiltered jitter.
SHARES = (0.9, 0.7, 0.5, 0.35, 0.25)
_NEEDED_STILL_S, _NEEDED_FAST_S = 2.0, 1.0


class Row(msgspec.Struct, frozen=True):
    """One setting and what it does; jitter per axis at rest, error in space in motion."""

    mincutoff_hz: float
    beta: float
    jitter_mm: float
    jitter_share: float
    error_mm: float
    lag_ms: float


class Proposal(msgspec.Struct, frozen=True):
    """The trade-off, calmest last, and the row that was asked for."""

    still_s: float
    moving_s: float
    noise_mm: float
    speed_m_s: float
    rows: list[Row]
    best: Row


class _Trial(NamedTuple):
    """One setting of the grid."""

    jitter_share: float
    error_m: float
    mincutoff_hz: float
    beta: float


def propose(tracks: list[Track], jitter_share: float = 0.5) -> Proposal:
    """The trade-off of one recording.

    Its best row is the setting that brings the jitter at rest to jitter_share of the unfiltered
    one. Raises CaptureError if the recording has too little rest or too little motion.
    """
    still_s = max((seconds_of(track.times_s, track.still) for track in tracks), default=0.0)
    moving_s = max((seconds_of(track.times_s, track.fast) for track in tracks), default=0.0)
    if still_s < _NEEDED_STILL_S or moving_s < _NEEDED_FAST_S:
        raise CaptureError(
            f"the recording has {still_s:.1f} s of a still and {moving_s:.1f} s of a moving hand; "
            f"hold the hand still for {_NEEDED_STILL_S:.0f} s at least, then move it fast for "
            f"{_NEEDED_FAST_S:.0f} s or more, all markers in both views"
        )
    table = _Table(tracks)
    best = table.row(jitter_share)
    if best is None:
        least = min(trial.jitter_share for trial in table.trials)
        raise CaptureError(
            f"no setting brings the jitter of {1e3 * table.noise_m:.2f} mm down to "
            f"{jitter_share:.2f} of it; the least is {least:.2f}: "
            f"use --jitter {least + 0.01:.2f} or more"
        )
    others = [row for share in SHARES if (row := table.row(share)) is not None]
    by_share = {row.jitter_share: row for row in [*others, best]}
    return Proposal(
        still_s=round(still_s, 2),
        moving_s=round(moving_s, 2),
        noise_mm=round(1e3 * table.noise_m, 4),
        speed_m_s=round(motion_speed_m_s(tracks, table.references), 3),
        rows=sorted(by_share.values(), key=lambda row: -row.jitter_share),
        best=best,
    )


class _Table:
    """All settings of the grid, tried on one recording."""

    def __init__(self, tracks: list[Track]) -> None:
        self.references = [reference_path(track) for track in tracks]  # (n, 3) each
        self.noise_m = jitter_m(tracks, [track.points_m for track in tracks])
        self.trials: list[_Trial] = []
        self._tracks = tracks
        for mincutoff_hz in CUTOFFS_HZ.tolist():
            for beta in BETAS.tolist():
                filtered = [one_euro_path(track, mincutoff_hz, beta) for track in tracks]
                share = jitter_m(tracks, filtered) / self.noise_m
                error_m = motion_error_m(tracks, filtered, self.references)
                self.trials.append(_Trial(share, error_m, mincutoff_hz, beta))

    def row(self, share: float) -> Row | None:
        """The setting with the least error among those calm enough; None if there is none."""
        allowed = [trial for trial in self.trials if trial.jitter_share <= share * 1.05]
        if not allowed:
            return None
        best = min(allowed, key=lambda trial: trial.error_m)
        filtered = [one_euro_path(track, best.mincutoff_hz, best.beta) for track in self._tracks]
        return Row(
            mincutoff_hz=round(best.mincutoff_hz, 2),
            beta=round(best.beta, 1),
            jitter_mm=round(1e3 * best.jitter_share * self.noise_m, 4),
            jitter_share=round(best.jitter_share, 4),
            error_mm=round(1e3 * best.error_m, 4),
            lag_ms=round(1e3 * lag_s(self._tracks, filtered, self.references), 4),
        )
