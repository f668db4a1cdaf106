"""The last half minute in figures: joint angles, delays, rates. Pure: time is an argument.

One ring of fixed size for all visitors. Only hands and cameras of rig.toml are kept, so nothing
from the network makes it grow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot import topics
from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.hand import DIGIT_ANGLES, DIGITS
from rhot.messages.health import Health
from services.viewer.live.views import View

# Half a minute on 350 pixels; more samples than pixels would not be seen.
SPAN_S, _RATE_HZ = 30.0, 12.0
_ROWS = int(SPAN_S * _RATE_HZ)
# What comes from the network is drawn within these: a full turn, ten seconds, a thousand a second.
_MOST = {"angle": 360.0, "delay": 10_000.0, "rate": 1000.0}


def angle_name(hand: str, digit: str, angle: str) -> str:
    """The series of a joint's angle, in degrees."""
    return f"angle/{hand}/{digit}/{angle}"


def delay_name(hand: str) -> str:
    """The series of how long after the light a hand's poses arrive, in ms."""
    return f"delay/{hand}"


def rate_name(what: str) -> str:
    """The series of how many messages a second come of a camera's markers or a hand's poses."""
    return f"rate/{what}"


class History:
    """Rows of figures, newest last; a figure that is not known at an instant is NaN."""

    def __init__(self, config: RigConfig) -> None:
        self._sources = {
            topics.MARKERS.key(config.rig.name, camera=camera.name): camera.name
            for camera in config.camera
        } | {topics.POSE.key(config.rig.name, hand=hand): f"{hand} hand" for hand in config.hand}
        names = [
            *(
                angle_name(hand, digit, angle)
                for hand in config.hand
                for digit, angles in zip(DIGITS, DIGIT_ANGLES, strict=True)
                for angle in angles
            ),
            *(delay_name(hand) for hand in config.hand),
            *(rate_name(what) for what in self._sources.values()),
        ]
        self._column = {name: column for column, name in enumerate(names)}
        self._rows = np.full((_ROWS, len(names)), np.nan)
        self._times_s = np.full(_ROWS, -np.inf)
        self._next = 0

    def take(self, view: View, now_s: float) -> None:
        """Note a view; those that come sooner than can be seen are left out."""
        since_s = now_s - self._times_s[self._next - 1]
        # A clock does not run backwards; another one's time begins anew.
        if 0.0 <= since_s < 1.0 / _RATE_HZ:
            return
        row = self._rows[self._next]
        row[:] = np.nan
        for name, value in [*_of_hands(view), *self._of_streams(view.health)]:
            if name in self._column:
                most = _MOST[name.partition("/")[0]]
                row[self._column[name]] = min(max(value, -most), most)
        self._times_s[self._next] = now_s
        self._next = (self._next + 1) % _ROWS

    def rows(self, names: Sequence[str], now_s: float) -> list[Array]:
        """Seconds before now (negative), then a series for each name: (n,) each, oldest first."""
        order = np.roll(np.arange(_ROWS), -self._next)
        before_s = self._times_s[order] - now_s
        kept = order[(before_s >= -SPAN_S) & (before_s <= 0.0)]
        return [
            self._times_s[kept] - now_s,
            *(self._rows[kept, self._column[name]] for name in names),
        ]

    def _of_streams(self, health: Sequence[Health]) -> list[tuple[str, float]]:
        return [
            (rate_name(self._sources[stream.key]), stream.rate_hz)
            for beat in health
            for stream in beat.streams
            if stream.direction == "out" and stream.key in self._sources
        ]


def _of_hands(view: View) -> list[tuple[str, float]]:
    found = []
    for hand, seen in view.hands.items():
        for digit, angles, finger in zip(DIGITS, DIGIT_ANGLES, seen.pose.fingers, strict=True):
            for angle in angles:
                degrees = float(np.rad2deg(getattr(finger.angles_rad, angle)))
                found.append((angle_name(hand, digit, angle), degrees))
        latency_ms = view.latency_ms.get(hand)
        if latency_ms is not None:
            found.append((delay_name(hand), latency_ms))
    return found
