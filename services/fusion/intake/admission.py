"""Which frames are admitted by their instant: not duplicates, nor those of a clock that jumped.

Cameras' clocks are only as good as their estimates. A wrong stamp must cost that camera's frames,
not the tracking.

A frame near the newest admitted instant is admitted. Frames far from it are held against it: while
others carry on they are refused. When nobody else does for a few frames, or when two cameras agree
on the new time, time itself has moved (a pause, a clock set everywhere): it starts anew there.
"""

from __future__ import annotations

from enum import Enum

# Frames this far from the newest instant are not of the same time. Longer than any hold, shorter
# than a second's jump of a clock.
WINDOW_NS = 500_000_000
# Frames of one camera in a row, with no others admitted meanwhile, that restart time: 3 are a tenth
# of a second at 30 fps.
_FRAMES_TO_RESTART = 3
# Stamps remembered for each camera to know a frame that comes twice: more than any queue holds.
_REMEMBERED = 64


class Verdict(Enum):
    """What to do with a frame."""

    ACCEPT = "accepted"
    RESTART = "restart"  # accept it, and forget everything before
    TWICE = "twice"  # a duplicate, or a stamp or number that stands still
    ASTRAY = "astray"  # its clock is off, or it is far too late


class FrameAdmission:
    """Decides on all cameras' frames by their instants (ns, master clock); holds no frames."""

    def __init__(self, cameras: int) -> None:
        self.newest_ns: int | None = None
        # By camera: the latest stamps, as keys in their order.
        self._known: list[dict[int, None]] = [{} for _ in range(cameras)]
        self._newest_seq: list[int | None] = [None] * cameras
        # By camera, since a frame was last admitted: its latest instant astray, and how many such
        # frames came in a row.
        self._astray: dict[int, tuple[int, int]] = {}

    def admit(
        self, camera: int, instant_ns: int, stamp_ns: int | None = None, seq: int | None = None
    ) -> Verdict:
        """The verdict on one frame; only admitted ones move time.

        stamp_ns is the instant on the camera's own clock and seq the frame's number, by which a
        frame is known again: its instant moves with the estimate of the clock's offset.
        """
        stamp_ns = instant_ns if stamp_ns is None else stamp_ns
        if stamp_ns in self._known[camera] or (seq is not None and seq == self._newest_seq[camera]):
            return Verdict.TWICE
        verdict = self._by_instant(camera, instant_ns)
        if verdict is not Verdict.ASTRAY:
            known = self._known[camera]
            known[stamp_ns] = None
            if len(known) > _REMEMBERED:
                del known[next(iter(known))]
            self._newest_seq[camera] = seq
            self._astray.clear()
        return verdict

    def _by_instant(self, camera: int, instant_ns: int) -> Verdict:
        if self.newest_ns is not None and abs(instant_ns - self.newest_ns) <= WINDOW_NS:
            self.newest_ns = max(self.newest_ns, instant_ns)
            return Verdict.ACCEPT
        if self.newest_ns is not None:
            run = self._count_astray(camera, instant_ns)
            if run < _FRAMES_TO_RESTART and not self._another_agrees(camera, instant_ns):
                return Verdict.ASTRAY
        self.newest_ns = instant_ns
        return Verdict.RESTART

    def _count_astray(self, camera: int, instant_ns: int) -> int:
        """Note a frame far from the present; how many consistent ones its camera sent in a row."""
        last_ns, run = self._astray.get(camera, (instant_ns, 0))
        run = run + 1 if 0 < instant_ns - last_ns <= WINDOW_NS else 1
        self._astray[camera] = (instant_ns, run)
        return run

    def _another_agrees(self, camera: int, instant_ns: int) -> bool:
        return any(
            other != camera and abs(other_ns - instant_ns) <= WINDOW_NS
            for other, (other_ns, _) in self._astray.items()
        )
