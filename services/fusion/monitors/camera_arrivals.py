"""Cameras from which nothing arrives, and cameras most of whose frames are rejected.

Fed once a second with what has been counted since; time is an argument.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

Rejection = tuple[str, str]  # reason, camera

# A link that was cut for a second, or a tracker that is restarted on a fast machine, is no fault.
_SILENT_S = 3.0
# Services of a rig start together, and a Raspberry Pi takes its time.
_START_S = 10.0
# Two bad seconds in a row: frames that were held up by the network come too late in one. Three good
# ones, and it is over.
_BAD, _GOOD = 2, 3
# What was counted over a longer time than this is of a machine that stood still.
_STOOD_STILL_S = 2.5


class CameraArrivals:
    """The latest arrival of each camera, and how long which rejections have gone on."""

    def __init__(self, cameras: Sequence[str], now_s: float) -> None:
        self._looked_s = now_s
        # Silence before this instant is nobody's fault.
        self._expected_s = now_s + _START_S - _SILENT_S
        self._arrived_s = dict.fromkeys(cameras, now_s)
        self._expected = True
        self._bad: Counter[Rejection] = Counter()
        self._good: Counter[Rejection] = Counter()
        self.rejecting: set[Rejection] = set()

    def look(
        self,
        admitted: Mapping[str, int],
        rejected: Mapping[Rejection, int],
        now_s: float,
        *,
        expected: bool,
    ) -> None:
        """Take in the frames since the last look, by camera, and by reason and camera.

        expected: whether cameras are to send anything.
        """
        stood_still = now_s - self._looked_s > _STOOD_STILL_S
        if stood_still or (expected and not self._expected):
            self._expected_s = max(self._expected_s, now_s)
        self._looked_s, self._expected = now_s, expected
        # A frame that comes again and again is no news of its camera.
        heard = {camera for (reason, camera), n in rejected.items() if n and reason != "twice"}
        heard |= {camera for camera, n in admitted.items() if n}
        for camera in self._arrived_s.keys() & heard:
            self._arrived_s[camera] = now_s
        for key in self.rejecting | self._bad.keys() | rejected.keys():
            self._note(key, bad=rejected.get(key, 0) > admitted.get(key[1], 0))

    def _note(self, key: Rejection, *, bad: bool) -> None:
        self._bad[key] = self._bad[key] + 1 if bad else 0
        self._good[key] = 0 if bad else self._good[key] + 1
        if self._bad[key] >= _BAD:
            self.rejecting.add(key)
        elif self._good[key] >= _GOOD:
            self.rejecting.discard(key)
            del self._bad[key], self._good[key]

    def silent_s(self, now_s: float) -> dict[str, float]:
        """For how long nothing has come from a camera, for those that should send."""
        if not self._expected:
            return {}
        silent = {
            camera: now_s - max(arrived_s, self._expected_s)
            for camera, arrived_s in self._arrived_s.items()
        }
        return {
            camera: now_s - self._arrived_s[camera]
            for camera, lasted_s in silent.items()
            if lasted_s >= _SILENT_S
        }
