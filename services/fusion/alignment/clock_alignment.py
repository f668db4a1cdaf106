"""Clocks that are off by more than the tuner of clocks may learn: found from motion, put right.

Every two seconds of frames, whether they are admitted or not, and every eight where all is well,
each camera's heights are compared with those of a reference camera over all offsets within 2.5 s
(offset_search.py). Where the views fit at another offset than the one in use, by more than the
tuner reaches, twice in a row, that camera's frames are shifted by it from then on: some seconds of
motion outweigh what a clock claims of itself. It comes before the timeline, which refuses frames
half a second astray. A clock that is set, or stamps that are right again, end it.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from rhot.geometry.camera import Camera
from services.fusion.alignment.height_memory import HeightMemory
from services.fusion.alignment.offset_search import Offset, find_offset
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.intake.observations import View

# A search takes 5 to 10 ms; every two seconds that would be a third of all that a rig costs. The
# first comes when there is enough to compare, and one that found something is soon followed by
# another. After each in a row that found a camera's clock to be right the next one waits twice as
# long, up to this many times, as long as the tuner's heights do not say that something changed.
_EVERY_S, _FIRST_S, _AGAIN_S, _MOST_PATIENT = 2.0, 3.0, 1.0, 4
# A search is put off in so many frames at most: one or two seconds of those that are learned from.
_MOST_PUT_OFF = 30
# Share of these two seconds by which rigs differ.
_APART = 0.2
# The tuner reaches so far: three announced sigmas, 5 ms at least; beyond 15 ms this is quicker.
_REACH_SIGMAS, _REACH_S, _REACH_MAX_S = 3.0, 5e-3, 15e-3
# An offset is used if it differs from the one in use by more of its sigmas than this, ... (Tuning
# halves, points under lasting errors of 0 to 3 px and pictures of both renderers: of 206 captures
# with clocks 10 or 20 ms off 129 are put right, 113 with 4; of 103 with right ones none.)
_SIGMAS = 3.0
# ... and if the next search says the same within so much.
_AGREE_S = 3e-3
# How well a clock is known that was put right (the tuner finds the rest).
_SIGMA_S = 1.5e-3
# An announced offset that moves by more than this was found anew: what was put right is not known
# any more.
_SET_S = 3e-3
# Frames refused in a row that are more than held up by the network.
_ASTRAY = 3


@dataclass(frozen=True)
class Correction:
    """A camera whose clock is put right, and by how much its stamps are late."""

    late_s: float
    claimed_sigma_s: float


def search_period_s(rig: str) -> float:
    """From one search of a rig to the next, by its name.

    Rigs of one process that began together would all search at once, every time: with 16 of them
    poses came 50 ms late.
    """
    return _EVERY_S * (1.0 + _APART * (zlib.crc32(rig.encode()) / 2**32 - 0.5))


class ClockAlignment:
    """The offsets in use of all C cameras, beyond those that they announce."""

    def __init__(
        self, cameras: tuple[Camera, ...], *, enabled: bool, every_s: float = _EVERY_S
    ) -> None:
        """Not enabled, nothing is put right; every_s: from one search to the next."""
        self._names = [camera.name for camera in cameras]
        self._pairs = rectified_pairs(cameras)
        self.enabled = enabled
        self._every_s = every_s
        self._memory = HeightMemory(len(cameras))
        self._corrections: dict[int, Correction] = {}
        # By camera: an offset that was found once and differs from the one in use.
        self._candidates: dict[int, float] = {}
        # By camera: its announced offset (ns) and sigma (s), and whether its frames are refused.
        self._announced: dict[int, tuple[int, float]] = {}
        # By camera: how many frames in a row were refused.
        self._astray = [0] * len(cameras)
        self._searched_s: dict[int, float] = {}
        # By camera: how many times as long as usual the next search waits.
        self._patience = [1] * len(cameras)
        # By camera: in how many frames a search was due, and other frames waited.
        self._put_off = [0] * len(cameras)
        self.searches = 0

    @property
    def corrections(self) -> dict[str, Correction]:
        """The cameras whose clocks are put right."""
        return {self._names[camera]: one for camera, one in sorted(self._corrections.items())}

    def observe(self, view: View, *, behind: bool = False, doubted: bool = False) -> bool:
        """Take in a frame as announced; whether clocks are put right otherwise than before.

        behind: other frames wait, also for a search, which is then put off for some frames.
        doubted: something says that clocks are not what they were found to be.
        """
        if not self.enabled:
            return False
        changed = self.note_announced(view)
        self._memory.add(view)
        camera = view.camera
        if doubted:
            self._patience[camera] = 1
        if self._is_due(camera):
            if behind and self._put_off[camera] < _MOST_PUT_OFF:
                self._put_off[camera] += 1
            else:
                self._put_off[camera] = 0
                changed |= self._search(camera)
        return changed

    def _is_due(self, camera: int) -> bool:
        """Whether a camera is to be compared with the reference."""
        newest_s = self._memory.newest_s(camera)
        if newest_s is None or self._memory.length_s(camera) < _FIRST_S:
            return False
        wait_s = self._every_s * self._patience[camera]
        if camera in self._candidates:
            wait_s = _AGAIN_S
        return not 0.0 <= newest_s - self._searched_s.get(camera, -np.inf) < wait_s

    def aligned(self, view: View) -> View:
        """A view with its clock put right."""
        known = self._corrections.get(view.camera)
        if known is None:
            return view
        return view._replace(
            instant_ns=view.instant_ns - round(known.late_s * 1e9),
            clock_sigma_s=max(view.clock_sigma_s, _SIGMA_S),
        )

    def note_verdict(self, camera: int, *, astray: bool) -> bool:
        """Whether a frame was refused for its instant; True if its clock is not put right any more.

        A camera whose clock is put right is refused only where its stamps have changed.
        """
        self._astray[camera] = self._astray[camera] + 1 if astray else 0
        if astray:
            self._patience[camera] = 1
        if self._astray[camera] < _ASTRAY or camera not in self._corrections:
            return False
        self._forget(camera)
        return True

    def _forget(self, camera: int) -> None:
        self._corrections.pop(camera, None)
        self._candidates.pop(camera, None)
        self._patience[camera] = 1
        self._memory.clear(camera)

    def note_announced(self, view: View) -> bool:
        """Forget a camera's offset if its clock was set; whether there was one.

        observe() does so, too; where that comes late, this is to be asked before aligned().
        """
        known = self._announced.get(view.camera)
        self._announced[view.camera] = (view.clock_offset_ns, view.clock_sigma_s)
        if known is None:
            return False
        moved_s = abs(view.clock_offset_ns - known[0]) * 1e-9
        if moved_s <= max(_SET_S, _REACH_SIGMAS * known[1]):
            return False
        had_one = view.camera in self._corrections
        self._forget(view.camera)
        return had_one

    def _reference(self) -> int:
        """The camera that others are compared with: one whose frames come, admitted as they are."""
        known = [c for c in sorted(self._announced) if self._memory.newest_s(c) is not None]
        as_announced = [c for c in known if not self._astray[c] and c not in self._corrections]
        if as_announced:
            return min(as_announced, key=lambda c: (self._announced[c][1], c))
        return known[0]

    def _search(self, camera: int) -> bool:
        """Compare a camera with the reference; whether its clock is put right otherwise now."""
        self._searched_s[camera] = self._memory.newest_s(camera) or 0.0
        reference = self._reference()
        pair = (min(reference, camera), max(reference, camera))
        if pair not in self._pairs:
            return False
        self.searches += 1
        sign = 1.0 if pair[1] == camera else -1.0
        found = find_offset(*self._memory.tracks(*pair, self._pairs[pair]), together=True)
        late_s = sign * found.offset_s + self._late_s(reference)
        candidate = self._candidates.pop(camera, None)
        is_right = found.decided and not self._beyond_reach(reference, camera, late_s, found)
        longer = min(2 * self._patience[camera], _MOST_PATIENT)
        self._patience[camera] = longer if is_right else 1
        if is_right or not found.decided:
            return False
        if candidate is None or abs(late_s - candidate) > _AGREE_S:
            self._candidates[camera] = late_s
            return False
        if abs(late_s) <= self._reach_s(reference, camera):
            self._corrections.pop(camera)
        else:
            self._corrections[camera] = Correction(late_s, self._announced[camera][1])
        return True

    def _late_s(self, camera: int) -> float:
        known = self._corrections.get(camera)
        return 0.0 if known is None else known.late_s

    def _reach_s(self, reference: int, camera: int) -> float:
        """How far apart two clocks may be that are left to the tuner."""
        sigmas_s = self._announced[reference][1] + self._announced[camera][1]
        return float(np.clip(_REACH_SIGMAS * sigmas_s, _REACH_S, _REACH_MAX_S))

    def _beyond_reach(self, reference: int, camera: int, late_s: float, found: Offset) -> bool:
        """Whether an offset differs from the one in use by more than the tuner will find."""
        away_s = abs(late_s - self._late_s(camera))
        reach_s = max(self._reach_s(reference, camera), _REACH_SIGMAS * _SIGMA_S)
        return away_s > max(reach_s, _SIGMAS * found.sigma_s)
