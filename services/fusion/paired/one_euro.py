"""The 1-Euro filter: a low-pass filter whose cutoff rises with speed.

So rest is calm and motion is prompt.

Casiez, Roussel, Vogel, "1 Euro Filter: A Simple Speed-based Low-pass Filter for Noisy Input in
Interactive Systems", CHI 2012, algorithm 1; RHOT section 10. Input that comes late or twice (time
does not advance) returns the last output unchanged. After a gap the filter simply sees a long step,
whose smoothing factor is near 1, so it jumps to the new value rather than sliding there.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array


def smoothing_factor(cutoff_hz: float | Array, dt_s: float) -> float | Array:
    """alpha of an exponential filter with that cutoff: 1 / (1 + tau / dt), tau = 1 / (2 pi cutoff).

    Casiez 2012, eq. (4) and (5).
    """
    tau = 1.0 / (2.0 * np.pi * cutoff_hz)
    return 1.0 / (1.0 + tau / dt_s)


class OneEuroFilter:
    """One filter for a value of any shape, each component by itself unless `joint`.

    mincutoff_hz: cutoff at rest; beta: how fast the cutoff rises with speed (per unit of the
    value); dcutoff_hz: cutoff of the speed estimate. joint: one cutoff from the length of the speed
    vector, so that a 3D path is smoothed alike whichever way it runs (the filter then commutes with
    rotations of the frame).
    """

    def __init__(
        self, mincutoff_hz: float, beta: float, dcutoff_hz: float, *, joint: bool = False
    ) -> None:
        self.mincutoff_hz = mincutoff_hz
        self.beta = beta
        self.dcutoff_hz = dcutoff_hz
        self.joint = joint
        self._value: Array | None = None
        self._speed: Array = np.zeros(())

    def reset(self) -> None:
        """Forget the past: the next value passes unchanged."""
        self._value = None

    def __call__(self, value: npt.ArrayLike, dt_s: float) -> Array:
        """The filtered value, same shape, dt_s seconds after the last (ignored for the first)."""
        x = np.asarray(value, dtype=np.float64)
        if self._value is None:
            self._value = x.copy()
            self._speed = np.zeros_like(x)
            return self._value.copy()
        if dt_s <= 0.0:
            return self._value.copy()
        # The reference data is reproduced only with the previous *filtered* value here: 2.5e-5
        # against .076 with the raw one.
        speed = (x - self._value) / dt_s
        self._speed = self._speed + smoothing_factor(self.dcutoff_hz, dt_s) * (speed - self._speed)
        magnitude = np.sqrt(np.sum(self._speed**2)) if self.joint else np.abs(self._speed)
        cutoff = self.mincutoff_hz + self.beta * magnitude
        self._value = self._value + smoothing_factor(cutoff, dt_s) * (x - self._value)
        return self._value.copy()
