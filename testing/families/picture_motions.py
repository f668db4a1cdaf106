"""How hands move before the simulator's cameras: gestures, carried along sharp paths. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from rhot.hand import HandModel
from services.simulator.hands.gestures import MOTIONS, Gesture, Motion
from testing.families.motions import back_and_forth, stop_and_go_path, strokes

_LONGEST_S = 12.0


@dataclass(frozen=True)
class Moves:
    """A gesture of the simulator, and a path that the hand is carried along meanwhile.

    stop_and_go: strength is its acceleration (m/s^2); flap and roll: the angle (deg) to either
    side, about the wrist's x and z, `hz` times a second.
    """

    gesture: str = "random"
    path: Literal["", "stop_and_go", "flap", "roll"] = ""
    strength: float = 0.0
    hz: float = 1.0
    seed: int = 1

    def motion(self, model: HandModel, seed: int) -> Motion:
        """The motion of a hand with these bones."""
        gesture = MOTIONS[self.gesture](model, seed)
        if not self.path:
            return gesture
        carried = self._carried()

        def at(t_s: float) -> Gesture:
            own, more = gesture(t_s), carried(t_s)
            return own._replace(turn_rad=own.turn_rad + more[:3], shift_m=own.shift_m + more[3:])

        return at

    def _carried(self) -> CubicSpline:
        """Turn (rad) and shift (m) of the wrist, side by side; (6,)."""
        if self.path == "stop_and_go":
            times_s, path = stop_and_go_path(self.strength, self.seed, seconds=_LONGEST_S)
            return CubicSpline(times_s, np.hstack([np.zeros_like(path), path]), axis=0)
        if self.path == "flap":
            times_s, way = strokes(self.hz, self.seed, _LONGEST_S)
        else:
            times_s = np.arange(0.0, _LONGEST_S, 2e-3)
            way = back_and_forth(times_s, self.hz, 0.3)
        values = np.zeros((len(times_s), 6))
        values[:, 0 if self.path == "flap" else 2] = np.deg2rad(self.strength) * way
        return CubicSpline(times_s, values, axis=0)
