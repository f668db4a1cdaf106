"""The height differences of one pair of cameras over the last instants: what clocks learn from."""

from __future__ import annotations

import math

import numpy as np

from services.fusion.monitors.epipolar_error import EpipolarError
from services.fusion.monitors.shift_regression import NOTHING, Heights, Shift, fit_shift

# Rows kept: 150 instants of six markers, 15 s of motion.
_ROWS = 900
# Over so many instants of motion evidence fades, e-fold: with fewer noise is learned; with more a
# clock that drifts is left behind. In between, as long as noise and drift ask for.
_MEMORY_MIN, _MEMORY_MAX = 30.0, 100.0
# A row was taken with another shift than today's, and the speed it is moved with changes on the way
# by a few times itself a second: 5 for a hand at 1 to 1.5 Hz.
_SPEED_CHANGES = 5.0
# Height errors larger than so many of their sigmas are another thing's.
_HEIGHT_SIGMAS = 10.0


class HeightWindow:
    """Rows of height differences, oldest first. A hand that rests takes no moving one's place."""

    def __init__(self, noise: float, height_sigma: float, walk_s: float) -> None:
        """noise: the least sigma of a height difference; height_sigma: of a constant one.

        walk_s: by how much the clocks drift from instant to instant, one sigma.
        """
        self._noise, self._height_sigma, self._walk_s = noise, height_sigma, walk_s
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        # Instant, landmark, height, speed, its span, variance, shift.
        self._rows = np.empty((0, 7))
        self.newest = 0  # number of the newest instant
        self._memory = _MEMORY_MIN
        self.moved_s = -np.inf  # when something moved last

    @property
    def instants(self) -> int:
        """Of how many instants there is evidence."""
        return self.newest - int(self._rows[0, 0]) + 1 if len(self._rows) else 0

    def add(self, errors: dict[int, EpipolarError], shift_s: float, bound_s: float) -> int:
        """Take in the errors of an instant by landmark, found at a shift; how many of them.

        Those that no shift within bound_s and no height error would explain are left out.
        """
        moves = any(error.speed for error in errors.values())
        if not moves and self.moved_s > -np.inf:
            return len(errors)
        self.newest += 1
        rows = [
            (
                self.newest,
                landmark,
                error.height,
                error.speed,
                error.span_s,
                error.variance + self._noise**2,
                shift_s,
            )
            for landmark, error in errors.items()
            if abs(error.height)
            <= 2.0 * bound_s * abs(error.speed) + _HEIGHT_SIGMAS * self._height_sigma
        ]
        if moves and rows:
            self.moved_s = max(error.time_s for error in errors.values())
        self._rows = np.concatenate([self._rows, np.array(rows).reshape(-1, 7)])[-_ROWS:]
        return len(rows)

    def keep(self, instants: int) -> None:
        """Forget what is older than so many instants."""
        self._rows = self._rows[self._rows[:, 0] > self.newest - instants]

    def fit(self, near_s: float, instants: float = np.inf) -> Shift:
        """The shift that explains the rows best, of those of the last instants."""
        table = self._rows[self.newest - self._rows[:, 0] < instants]
        if not len(table):
            return NOTHING
        instant, landmark, heights, speeds, spans, variances, shifts = table.T
        moved = _SPEED_CHANGES * speeds * (shifts - near_s) ** 2
        rows = Heights(
            instant.astype(np.int64),
            landmark.astype(np.int64),
            heights,
            shifts,
            speeds,
            spans,
            variances + moved**2,
            np.exp((instant - self.newest) / self._memory),
        )
        return fit_shift(rows, near_s, self._height_sigma)

    def adapt_memory(self, found: Shift) -> None:
        """Remember for as long as the noise of what was found asks for.

        The mean of n instants has the variance one / n of noise and n walk^2 / 3 of drift.
        """
        of_one = found.variance * min(self._memory, self.instants)
        if math.isfinite(of_one):
            best = math.sqrt(3.0 * of_one) / self._walk_s
            self._memory = min(max(best, _MEMORY_MIN), _MEMORY_MAX)
