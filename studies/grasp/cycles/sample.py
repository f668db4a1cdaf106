"""The frames of interest of a closing: N instants at equal steps of time. Pure.

Every quantity is interpolated linearly in time between the two measured frames around the instant
(a direction and the angles as numbers, which do not jump: track.py). At 30 frames/s a finger that
closes in a second deviates from the chord by 0.2 deg at most; a cubic would ring where a dot was
missed. An instant whose neighbours are too far apart stays unmeasured.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.track import FingerTrack, track_of_columns

# The paper's frames of interest of each closing cycle.
PAPER_FRAMES = 37
# Neighbours further apart than this share of the cycle, and than 2.5 usual steps, tell nothing.
_GAP_SHARE = 0.12


def sampled(track: FingerTrack, start_s: float, end_s: float, count: int) -> FingerTrack:
    """The track at `count` instants from start to end, both included."""
    instants_s = np.linspace(start_s, end_s, count)
    longest_s = max(_GAP_SHARE * (end_s - start_s), 2.5 * float(np.median(np.diff(track.times_s))))
    columns = track.columns()
    made = np.column_stack(
        [interpolated(instants_s, track.times_s, column, longest_s) for column in columns.T]
    )
    return track_of_columns(instants_s, made)


def interpolated(instants_s: Array, times_s: Array, values: Array, longest_s: float) -> Array:
    """Values (n,) at instants (m,), linear; NaN across gaps longer than longest_s and outside."""
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(instants_s), np.nan)
    own_s, own = times_s[known], values[known]
    made = np.interp(instants_s, own_s, own)
    # Instants come from a sum of steps: the last may lie a rounding beyond the last frame.
    slack = 1e-9 * max(1.0, abs(float(own_s[-1])))
    after = np.clip(np.searchsorted(own_s, instants_s - slack), 1, max(len(own_s) - 1, 1))
    gap = own_s[np.minimum(after, len(own_s) - 1)] - own_s[after - 1]
    near = np.abs(instants_s[:, None] - own_s[None, [0, -1]]).min(axis=1) <= longest_s
    outside = (instants_s < own_s[0] - slack) | (instants_s > own_s[-1] + slack)
    made[(gap > longest_s) | (outside & ~near)] = np.nan
    return made
