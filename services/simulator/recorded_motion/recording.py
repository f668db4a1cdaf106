"""What a recording of a hand is, once it is read: joints that bones can follow, or points alone.

Frames of a recording are any right-handed ones; a hand is turned to the cameras later. Times are
seconds from the first frame, increasing; frames may be missing. Pure.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.hand import HandName

# Frames nearer than this to the one before them are left out: recordings repeat some.
_SAME_INSTANT_S = 1e-4
# A cubic crosses gaps up to this long. Gaps of 0.1 s cut out of the Leap recordings and the
# Qualisys glove's are crossed with .4 to 5.4 mm RMS (fast waving), gaps of 0.2 s with .8 to 21 mm.
LONGEST_GAP_S = 0.1
# Shorter ones show no motion.
_SHORTEST_S = 0.1


@dataclass(frozen=True, eq=False)
class RecordedJoints:
    """A hand whose chains were recorded: the four joints of each digit, root to tip.

    axes are the columns x (right), y (out of the back of the hand), z (away from the fingers).
    origin_m is fixed to the hand: the wrist, or, where is_wrist is false, the palm's centre.
    angles_rad are the recording's own in the order of DIGIT_ANGLES, if it has any.
    """

    hand: HandName
    times_s: Array  # (n,)
    joints_m: Array  # (n, 5, 4, 3)
    origin_m: Array  # (n, 3)
    axes: Array  # (n, 3, 3)
    is_wrist: bool
    angles_rad: Array | None = None  # (n, 5, 4)

    def rows(self, keep: Array) -> RecordedJoints:
        """The frames keep (k,) alone, by number."""
        return RecordedJoints(
            self.hand,
            self.times_s[keep] - self.times_s[keep[0]],
            self.joints_m[keep],
            self.origin_m[keep],
            self.axes[keep],
            self.is_wrist,
            None if self.angles_rad is None else self.angles_rad[keep],
        )


@dataclass(frozen=True, eq=False)
class RecordedPoints:
    """A hand of which points alone were recorded, in the order of BASIC_LANDMARKS.

    NaN where one is missing.
    """

    hand: HandName
    times_s: Array  # (n,)
    points_m: Array  # (n, 6, 3)


def usable_rows(times_s: Array, name: str) -> Array:
    """Numbers (k,) of the frames of the longest stretch without a gap that a cubic cannot cross.

    times_s (n,) may repeat. Raises CaptureError where no stretch shows any motion.
    """
    ahead = np.concatenate([[True], times_s[1:] - np.maximum.accumulate(times_s)[:-1] > 0.0])
    rows = np.flatnonzero(ahead)
    rows = rows[np.concatenate([[True], np.diff(times_s[rows]) > _SAME_INSTANT_S])]
    cuts = np.flatnonzero(np.diff(times_s[rows]) > LONGEST_GAP_S) + 1
    stretches = np.split(rows, cuts)
    longest = max(stretches, key=lambda part: times_s[part[-1]] - times_s[part[0]])
    span_s = float(times_s[longest[-1]] - times_s[longest[0]])
    if len(longest) < 4 or span_s < _SHORTEST_S:
        raise CaptureError(
            f"{name}: its longest stretch without a gap above {LONGEST_GAP_S:g} s has"
            f" {len(longest)} frames in {span_s:.2f} s; a motion needs at least four frames and"
            f" {_SHORTEST_S:g} s"
        )
    return longest
