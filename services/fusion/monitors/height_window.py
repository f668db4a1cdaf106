"""The height differences of one pair of cameras over the last instants: what clocks learn from."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.monitors.epipolar_error import EpipolarErrors
from services.fusion.monitors.shift_regression import Heights, Shift, fitted_shift

# Rows kept: 150 instants of six markers, 15 s of motion.
_ROWS = 900
# Of a row: instant, landmark, height, speed, its span, variance, shift.
_COLUMNS = 7
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
        # With room for as many again: rows move to the front once it is full.
        self._table = np.empty((_COLUMNS, 2 * _ROWS))
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._begin = self._end = 0
        self.newest = 0  # number of the newest instant
        self._memory = _MEMORY_MIN
        self.moved_s = -np.inf  # when something moved last

    @property
    def instants(self) -> int:
        """Of how many instants there is evidence."""
        if self._begin == self._end:
            return 0
        return self.newest - int(self._table[0, self._begin]) + 1

    def add(self, errors: EpipolarErrors, shift_s: float, bound_s: float) -> int:
        """Take in the errors of an instant, found at a shift; how many of them.

        Those that no shift within bound_s and no height error would explain are left out.
        """
        moves = bool(errors.speeds.any())
        if not moves and self.moved_s > -np.inf:
            return len(errors.landmarks)
        self.newest += 1
        self._make_room(len(errors.landmarks))
        taken = _append(
            self._table,
            self._end,
            errors,
            (float(self.newest), shift_s, self._noise),
            (2.0 * bound_s, _HEIGHT_SIGMAS * self._height_sigma),
        )
        if moves and taken:
            self.moved_s = float(errors.times_s.max())
        self._end += taken
        self._begin = max(self._begin, self._end - _ROWS)
        return taken

    def _make_room(self, rows: int) -> None:
        if self._end + rows <= self._table.shape[1]:
            return
        kept = self._table[:, self._begin : self._end].copy()
        self._begin, self._end = 0, kept.shape[1]
        self._table[:, : self._end] = kept

    def keep(self, instants: int) -> None:
        """Forget what is older than so many instants."""
        self._begin = self._first_of(instants)

    def fit(self, near_s: float, instants: float = np.inf) -> Shift:
        """The shift that explains the rows best, of those of the last instants."""
        rows = self._first_of(instants), self._end
        remembered = self.newest, self._memory
        return Shift(*_fit(self._table, rows, remembered, near_s, self._height_sigma))

    def _first_of(self, instants: float) -> int:
        """The first row of the last instants."""
        known = self._table[0, self._begin : self._end]
        return self._begin + int(np.searchsorted(known, self.newest - instants, side="right"))

    def adapt_memory(self, found: Shift) -> None:
        """Remember for as long as the noise of what was found asks for.

        The mean of n instants has the variance one / n of noise and n walk^2 / 3 of drift.
        """
        of_one = found.variance * min(self._memory, self.instants)
        if math.isfinite(of_one):
            best = math.sqrt(3.0 * of_one) / self._walk_s
            self._memory = min(max(best, _MEMORY_MIN), _MEMORY_MAX)


@njit(cache=True, error_model="numpy")
def _append(
    table: Array,
    end: int,
    errors: EpipolarErrors,
    known: tuple[float, float, float],
    explained: tuple[float, float],
) -> int:
    """Write the rows of an instant to a table (7, ...) from column `end` on; how many.

    known: the instant's number, the shift and the least noise; explained: what a height may be, by
    its speed, and beyond.
    """
    newest, shift_s, noise = known
    k = end
    for i in range(len(errors.landmarks)):
        speed, height = errors.speeds[i], errors.heights[i]
        if not abs(height) <= explained[0] * abs(speed) + explained[1]:
            continue
        table[0, k], table[1, k] = newest, errors.landmarks[i]
        table[2, k], table[3, k], table[4, k] = height, speed, errors.spans_s[i]
        table[5, k], table[6, k] = errors.variances[i] + noise**2, shift_s
        k += 1
    return k - end


@njit(cache=True, error_model="numpy")
def _fit(
    table: Array,
    rows: tuple[int, int],
    remembered: tuple[int, float],
    near_s: float,
    height_sigma: float,
) -> tuple[float, float, float, float]:
    """What Shift has, of some columns of a table (7, ...), from and up to which `rows` says.

    remembered: the newest instant, and how long evidence lasts.
    """
    (begin, end), (newest, memory) = rows, remembered
    n = end - begin
    instants, landmarks = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    variances, weights = np.empty(n), np.empty(n)
    heights, speeds, spans = table[2, begin:end], table[3, begin:end], table[4, begin:end]
    shifts = table[6, begin:end]
    for i in range(n):
        instants[i], landmarks[i] = int(table[0, begin + i]), int(table[1, begin + i])
        moved = _SPEED_CHANGES * speeds[i] * (shifts[i] - near_s) ** 2
        variances[i] = table[5, begin + i] + moved**2
        same = i > 0 and instants[i] == instants[i - 1]
        weights[i] = weights[i - 1] if same else math.exp((instants[i] - newest) / memory)
    found = Heights(instants, landmarks, heights, shifts, speeds, spans, variances, weights)
    return fitted_shift(found, near_s, height_sigma)
