"""What a case is: markers as trackers send them, what fusion is given, and the truth beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import HandModel, HandName
from rhot.messages import MarkerFrame
from testing.synthetic_points import START_NS

# Constants may be chosen on the tuning half only; the held-out half judges them.
Half = Literal["tuning", "held_out"]
# points: geometry, timing and noise alone. pictures: rendered, and found by the real tracker.
Kind = Literal["points", "pictures"]
HALVES: tuple[Half, ...] = ("tuning", "held_out")
KINDS: tuple[Kind, ...] = ("points", "pictures")
Bools = npt.NDArray[np.bool_]

# A marker of which a camera sees this share counts as seen; one of which it sees that share, as
# unhidden: the rest is the edge's own pixels.
SEEN_SHARE, UNHIDDEN_SHARE = 0.5, 0.95


@dataclass(frozen=True, eq=False)
class Case:
    """Markers of a hand in motion, and its truth.

    frames are in the order of their exposure. hands are what fusion and solver are *given*, usually
    the tables' hand at a guessed size, not the one that was painted. truth gives the middles of the
    paint (n, L, 3) m in the rig frame at n instants, seconds of the master's clock since START_NS,
    NaN where a recording has a gap;
    angles the joint angles (5, 4) rad, None where there is no skeleton. visible (f, L) is the share
    of each landmark's paint that the frame's camera sees.
    """

    name: str
    config: RigConfig
    cameras: dict[str, Camera]
    hands: dict[HandName, HandModel]
    frames: list[MarkerFrame]
    visible: Array  # (f, L)
    landmarks: tuple[str, ...]
    truth: Callable[[Array], Array]
    seconds: float
    angles: Callable[[float], Array] | None = None
    # What to take off a camera's stamps and announced offset to come to the master's clock; s.
    clock_errors_s: dict[str, float] | None = None

    @property
    def hand(self) -> HandName:
        """The one hand of the case."""
        return next(iter(self.config.hand))

    def frame_times_s(self) -> Array:
        """When each frame's middle row was exposed, by its true clock; (f,) s."""
        found = []
        for frame in self.frames:
            late_s = (self.clock_errors_s or {}).get(frame.camera, 0.0)
            middle_ns = 0.5 * frame.size_px[1] * frame.row_time_ns
            stamp_ns = frame.stamp_ns - frame.clock_offset_ns - START_NS
            found.append((stamp_ns + middle_ns) * 1e-9 - late_s)
        return np.array(found)

    def shares(self, instants_s: Array, around: float) -> Array:
        """The smallest share of each landmark that any camera saw about n instants; (n, L).

        Of each camera the frames within `around` of its periods count; one that has none saw
        nothing.
        """
        times_s, least = self.frame_times_s(), np.full((len(instants_s), len(self.landmarks)), 1.0)
        for name in self.cameras:
            rows = np.flatnonzero([frame.camera == name for frame in self.frames])
            reach_s = around / self.config.camera_named(name).fps
            begin = np.searchsorted(times_s[rows], instants_s - reach_s)
            end = np.searchsorted(times_s[rows], instants_s + reach_s)
            for n, (first, last) in enumerate(zip(begin.tolist(), end.tolist(), strict=True)):
                seen = self.visible[rows[first:last]]
                least[n] = np.minimum(least[n], seen.min(axis=0) if len(seen) else 0.0)
        return least

    def seen(self, instants_s: Array) -> Bools:
        """Which landmarks all cameras see about n instants; (n, L)."""
        # A frame period to either side would ask for two frames; three quarters always hold one.
        return self.shares(instants_s, 0.75) >= SEEN_SHARE

    def unhidden(self, instants_s: Array) -> Bools:
        """Which landmarks all cameras see whole about n instants, the frames beside too; (n, L)."""
        return self.shares(instants_s, 1.5) >= UNHIDDEN_SHARE

    def top_speed_m_s(self) -> float:
        """The largest speed of any landmark."""
        times_s = np.arange(0.0, self.seconds, 5e-3)
        path = self.truth(times_s)
        return float(np.nanmax(np.linalg.norm(np.diff(path, axis=0), axis=2)) / 5e-3)


@dataclass(frozen=True)
class CaseSpec:
    """A case that has yet to be made."""

    family: str
    name: str
    half: Half
    kind: Kind
    build: Callable[[], Case]
