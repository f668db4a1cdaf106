"""The track of one colour's marker: constant-velocity prediction, and likeness of blobs to it.

Pure. Stamps may stand still or run backwards: velocity is then zero, and likeness stays in 0..1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from services.pi_tracker.image.blob import Blob

# A hand at arm's length moves 2 m/s when it is fast: at 0.5 m and f = 527 px that is 2100 px/s.
_MAX_SPEED_PX_S = 2100.0
# A remembered area follows the marker with this weight of the old one per frame.
AREA_MEMORY = 0.8
# What it is where all of it shows rises as fast and falls so slowly: frames in which half of a
# marker is found follow one another, and each would let the next have no more. It rises to no more
# than so many times what was found before it grew: else it might grow on, with each frame.
_WHOLE_MEMORY, _SURE_TIMES = 0.98, 2.5
# A track that moves less than this a frame stands still.
_STATIONARY_PX = 1.0
# What two frames tell of a marker's motion is so unsure: where the others moved less, one that is
# lost is taken to move as they do. (Not tuned: what middles of blobs jump by in blur.)
_UNSURE_PX = 3.0
# Velocity predicts for so long; after a longer gap the old place tells nothing of it.
_MAX_PREDICTION_S = 0.1
# A blob is at the predicted place of a marker seen less than so long ago when it is within so many
# pixels, and so many more per second since. In the simulator's hard scene, 95 % of 427 markers half
# occluded by another were within 21 px of it, and no mere edge of another's paint was. While it is
# occluded the finger moves on, by so much more.
_GATE_PX, _GATE_PX_S, RECENT_NS = 20.0, 40.0, 300_000_000

Vector = tuple[float, float]


@dataclass(slots=True)
class Track:
    """Position and velocity of one colour's marker at stamp_ns.

    Measured then, or, since seen_ns, carried on with the other markers' motion (a coasting track).
    """

    x_px: float
    y_px: float
    area_px: float
    # Of its blobs as they were found, before they grew.
    found_px2: float
    stamp_ns: int
    vx_px_s: float = 0.0
    vy_px_s: float = 0.0
    # Frames in a row in which it has not moved.
    stationary_frames: int = 0
    seen_ns: int = -1
    # How much of the others' motion it had as it was seen last.
    motion_share: float = 1.0
    # Its area where all of it shows.
    whole_px2: float = field(init=False)

    def __post_init__(self) -> None:
        self.seen_ns, self.whole_px2 = self.stamp_ns, self.area_px

    def predicted(self, stamp_ns: int) -> tuple[float, float]:
        """Its position at a time, px."""
        ahead_s = (stamp_ns - self.stamp_ns) * 1e-9
        # By comparisons: min and max take twice as long, of every marker in every picture.
        if ahead_s <= 0.0:
            return self.x_px, self.y_px
        if ahead_s > _MAX_PREDICTION_S:
            ahead_s = _MAX_PREDICTION_S
        return self.x_px + self.vx_px_s * ahead_s, self.y_px + self.vy_px_s * ahead_s

    def update(
        self,
        x_px: float,
        y_px: float,
        area_px: float,
        found_px2: float,
        stamp_ns: int,
        area_memory: float = AREA_MEMORY,
    ) -> None:
        """Take in a measurement; area_memory is the weight of the old area."""
        moved_px = abs(x_px - self.x_px) + abs(y_px - self.y_px)
        self.stationary_frames = self.stationary_frames + 1 if moved_px < _STATIONARY_PX else 0
        self._move(x_px, y_px, stamp_ns)
        self.area_px = area_memory * self.area_px + (1.0 - area_memory) * area_px
        self.found_px2 += (1.0 - AREA_MEMORY) * (found_px2 - self.found_px2)
        sure_px2 = min(area_px, _SURE_TIMES * max(found_px2, self.found_px2))
        memory = AREA_MEMORY if sure_px2 > self.whole_px2 else _WHOLE_MEMORY
        self.whole_px2 += (1.0 - memory) * (sure_px2 - self.whole_px2)
        self.seen_ns = stamp_ns

    def coast(self, moved_px: Vector, before_px_s: Vector, stamp_ns: int) -> None:
        """It was not seen; the other markers moved by moved_px, and at before_px_s until then.

        It goes on with as much of their motion as it had: a hand that flaps turns about its wrist.
        """
        if self.stamp_ns == self.seen_ns:
            self.motion_share = self._share_of(before_px_s, stamp_ns)
        dx_px, dy_px = moved_px
        self._move(
            self.x_px + self.motion_share * dx_px, self.y_px + self.motion_share * dy_px, stamp_ns
        )

    def _share_of(self, others_px_s: Vector, stamp_ns: int) -> float:
        """How much of the others' motion its own is, 0 to 1; 1 where neither is known."""
        vx, vy = others_px_s
        elapsed_s = (stamp_ns - self.stamp_ns) * 1e-9
        if elapsed_s <= 0.0 or self.vx_px_s == self.vy_px_s == 0.0:
            return 1.0
        unsure = (_UNSURE_PX / elapsed_s) ** 2
        along = self.vx_px_s * vx + self.vy_px_s * vy
        return min(max((along + unsure) / (vx * vx + vy * vy + unsure), 0.0), 1.0)

    def _move(self, x_px: float, y_px: float, stamp_ns: int) -> None:
        elapsed_s = (stamp_ns - self.stamp_ns) * 1e-9
        if 0.0 < elapsed_s < _MAX_PREDICTION_S:
            self.vx_px_s = (x_px - self.x_px) / elapsed_s
            self.vy_px_s = (y_px - self.y_px) / elapsed_s
        else:
            self.vx_px_s = self.vy_px_s = 0.0
        self.x_px, self.y_px, self.stamp_ns = x_px, y_px, stamp_ns

    def likeness(self, blob: Blob, stamp_ns: int, margin_px: float) -> float:
        """How well a blob agrees with this track in place and size, 0..1."""
        x, y = self.predicted(stamp_ns)
        dx, dy = blob.x_px - x, blob.y_px - y
        unseen_ns = stamp_ns - self.seen_ns
        unseen_s = (
            0.0 if unseen_ns <= 0 else 1.0 if unseen_ns >= 1_000_000_000 else unseen_ns * 1e-9
        )
        reach_px = margin_px + _MAX_SPEED_PX_S * unseen_s
        # Blobs are compared as they are found, before they grow.
        a, b = blob.area_px, self.found_px2
        if a > b:
            a, b = b, a
        size_ratio = a / b if b > 1.0 else a
        return math.sqrt(size_ratio) / (1.0 + (dx * dx + dy * dy) / (reach_px * reach_px))

    def is_recent(self, stamp_ns: int, within_ns: int = RECENT_NS) -> bool:
        """Whether it was seen so lately."""
        return 0 <= stamp_ns - self.seen_ns <= within_ns

    def is_at(self, blob: Blob, stamp_ns: int) -> bool:
        """Whether a blob is within the gate about the predicted place of a recent track."""
        unseen_ns = stamp_ns - self.seen_ns
        x, y = self.predicted(stamp_ns)
        return (
            self.is_recent(stamp_ns)
            and max(abs(blob.x_px - x), abs(blob.y_px - y))
            <= _GATE_PX + _GATE_PX_S * unseen_ns * 1e-9
        )
