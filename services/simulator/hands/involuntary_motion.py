"""Involuntary motion of a hand: slow sway, restless fingers and physiological tremor. Pure.

Sway is some millimetres, fingers move by tenths of one. Tremor is 8-12 Hz, about 0.1 mm at the
outstretched hand (Elble & Randall, Electroenceph. clin. Neurophysiol. 44, 1978).
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HandModel
from services.simulator.hands.gestures import TAU

# Amplitudes of the hand's three slow waves and of its tremor: turn 0.4 and 0.05 deg, shift 1.2 and
# 0.1 mm.
_HAND_AMPLITUDES = np.array([[0.007, 0.007, 0.007, 0.0009], [1.2e-3, 1.2e-3, 1.2e-3, 1e-4]])
# Each joint sways by .11 deg a wave and trembles by .02 deg: .3 and .03 mm at the tip of a
# stretched finger, a fifth of what the hand's sway does.
_FINGER_AMPLITUDES = np.array([0.002, 0.002, 0.002, 0.0004])
# Angle from a limit at which a joint's sway is halved; above the largest sway, so that no limit is
# passed.
_LIMIT_MARGIN_RAD = 0.02


class InvoluntaryMotion:
    """What one hand does without meaning to; the same random seed moves in the same way."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, 11])
        slow = rng.uniform(0.1, 0.7, (2, 3, 3))
        fast = rng.uniform(8.0, 12.0, (2, 3, 1))
        self._omega = TAU * np.concatenate([slow, fast], axis=2)  # (turn / shift, axis, wave)
        self._phase = rng.uniform(0.0, TAU, (2, 3, 4))
        slow, fast = rng.uniform(0.1, 0.7, (5, 4, 3)), rng.uniform(8.0, 12.0, (5, 4, 1))
        self._finger_omega = TAU * np.concatenate([slow, fast], axis=2)  # (digit, joint, wave)
        self._finger_phase = rng.uniform(0.0, TAU, (5, 4, 4))

    def __call__(self, t_s: float) -> tuple[Array, Array]:
        """(rotation vector (3,) rad, shift (3,) m) of the whole hand at t_s."""
        waves = np.sin(self._omega * t_s + self._phase)  # (2, 3, 4)
        turn, shift = np.sum(_HAND_AMPLITUDES[:, None, :] * waves, axis=2)
        return turn, shift

    def fingers(self, t_s: float, angles_rad: Array, model: HandModel) -> Array:
        """The joint angles at t_s of a hand that means to have angles_rad; (5, 4) -> (5, 4).

        They stay inside the limits, and the coupling of DIP to PIP stays as it was.
        """
        waves = np.sin(self._finger_omega * t_s + self._finger_phase)  # (5, 4, 4)
        sway = np.sum(_FINGER_AMPLITUDES * waves, axis=2)  # (5, 4)
        low, high = model.limits_rad[..., 0], model.limits_rad[..., 1]
        room = np.maximum(np.minimum(angles_rad - low, high - angles_rad), 0.0)
        # Smoothly less towards a limit, and never beyond.
        angles = angles_rad + sway * room / (room + _LIMIT_MARGIN_RAD)
        coupling = np.array([digit.coupling for digit in model.digits])
        angles[:, 3] = np.clip(
            angles_rad[:, 3] + coupling * (angles[:, 2] - angles_rad[:, 2]), low[:, 3], high[:, 3]
        )
        return np.asarray(angles)
