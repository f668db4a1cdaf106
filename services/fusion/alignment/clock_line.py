"""One clock against another as a line: an offset at some instant, and a drift; fitted to heights.

The recording is cut into windows; in each the shift is a robust regression of its own
(shift_regression.py: its variance holds for errors that last, and for wrong markers). A line
through the windows' shifts, weighted by their variances and robust again, gives offset and drift.
What the windows scatter beyond their variances widens both. Pure.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.height_rows import INSTANTS_HZ, ROWS_HZ, Rows, rows_of, take
from services.fusion.alignment.height_track import HeightTrack
from services.fusion.monitors.shift_regression import Heights, Shift, fit_shift

# Rounds of looking again from where the last one led (the regression is linear in the shift), and
# the share of its sigma by which a settled one moves.
_ROUNDS, _SETTLED = 4, 0.02
# A window, s, and how many at most.
_WINDOW_S, _WINDOWS = 5.0, 120
# Clocks of cameras differ by so much (one sigma: quartz is within 20 to 50 ppm): what little a
# short recording tells of a drift is weighed against it; at 200 ppm it costs .3 ms in 10 s at most.
_DRIFT_SIGMA = 50e-6
# A line that leaves the one it was looked for from by more than this, s, is another one.
_STRAY_S = 0.04
# A landmark's constant height difference may be so large (a bumped camera, paint of some size).
CONSTANT = 4e-3
# Windows beyond so many sigmas of the line have no weight.
_TUKEY = 4.7
# What a centre's own errors and stamps of a microsecond or so leave, s; and what errors that last
# for longer than a regression looks back add to its sigmas (1 px of them, tuning motions: 1.46).
_SIGMA_FLOOR_S, _LASTING = 2e-5, 1.4


T = TypeVar("T", float, Array)


class ClockLine(NamedTuple):
    """How much later the second clock reads: offset_s where the first reads at_s, and drift a s."""

    offset_s: float
    drift: float
    at_s: float

    def late_s(self, first_s: float) -> float:
        """At an instant of the first clock."""
        return self.offset_s + self.drift * (first_s - self.at_s)

    def first_s(self, second_s: T) -> T:
        """The first clock's instants at the second's."""
        return self.at_s + (second_s - self.at_s - self.offset_s) / (1.0 + self.drift)


class LineFit(NamedTuple):
    """A line, and how well it is known: at its at_s, where offset and drift are independent.

    wander_s is by how much windows leave the line, RMS, beyond their noise; windows how many tell.
    """

    line: ClockLine
    offset_sigma_s: float
    drift_sigma: float
    wander_s: float
    windows: int

    def sigma_s(self, first_s: float) -> float:
        """Of late_s at an instant of the first clock."""
        return math.hypot(self.offset_sigma_s, self.drift_sigma * (first_s - self.line.at_s))


def rows_along(
    pairs: list[tuple[HeightTrack, HeightTrack]], line: ClockLine, rows_hz: float = ROWS_HZ
) -> Rows | None:
    """Height differences with the second clock put right by a line."""
    return rows_of(
        [(one, other._replace(times_s=line.first_s(other.times_s))) for one, other in pairs],
        rows_hz,
    )


def fit_line(pairs: list[tuple[HeightTrack, HeightTrack]], near: ClockLine) -> LineFit | None:
    """The line that explains heights best, looked for from near; None if nothing tells."""
    line, fit = near, None
    for _ in range(_ROUNDS):
        rows = rows_along(pairs, line)
        if rows is None:
            return None
        begin_s = min(
            min(float(one.times_s[0]), line.first_s(float(other.times_s[0])))
            for one, other in pairs
        )
        shifts, at_s = _window_shifts(rows.heights, begin_s)
        if not shifts:
            return None
        fit = _through(shifts, np.array(at_s), line)
        moved_s = abs(fit.line.late_s(fit.line.at_s) - line.late_s(fit.line.at_s))
        line = fit.line
        if moved_s < _SETTLED * fit.offset_sigma_s:
            break
        if abs(line.late_s(near.at_s) - near.offset_s) > _STRAY_S:
            return None
    return fit


def _window_shifts(rows: Heights, begin_s: float) -> tuple[list[Shift], list[float]]:
    """The shift of each window that tells, and where on the first clock it lies, s."""
    numbers = rows.instants
    first, last = int(numbers[0]), int(numbers[-1])
    count = int(np.clip(round((last - first) / (INSTANTS_HZ * _WINDOW_S)), 1, _WINDOWS))
    edges = np.linspace(first, last + 1, count + 1)
    shifts, at_s = [], []
    for begin, end in pairwise(edges.tolist()):
        own = slice(*np.searchsorted(numbers, [begin, end]).tolist())
        part = take(rows, own)
        found = fit_shift(part, 0.0, CONSTANT)
        if math.isfinite(found.variance):
            shifts.append(found)
            weights = part.speeds**2 / part.variances + 1e-12
            at_s.append(begin_s + float(part.instants @ weights / weights.sum()) / INSTANTS_HZ)
    return shifts, at_s


def _through(shifts: list[Shift], at_s: Array, line: ClockLine) -> LineFit:
    """The line with the shifts that are left about it."""
    values = np.array([shift.shift_s for shift in shifts])
    sigmas = _LASTING * np.sqrt([shift.variance for shift in shifts])
    robust, scale = np.ones(len(values)), 1.0
    middle = offset = drift = information = spread = 0.0
    for _ in range(_ROUNDS):
        weights = robust / sigmas**2
        information = float(weights.sum())
        middle = float(weights @ at_s) / information
        since = at_s - middle
        spread = float(weights @ since**2)
        offset = float(weights @ values) / information
        prior = (scale / _DRIFT_SIGMA) ** 2
        # The drift as a whole is held against the prior, not what this round adds.
        drift = (float(weights @ (since * values)) - prior * line.drift) / (spread + prior)
        away = np.abs(values - offset - drift * since) / sigmas
        if len(values) > 3:
            scale = max(1.0, 1.48 * float(np.median(away)))
        robust = np.maximum(np.clip(1.0 - (away / (_TUKEY * scale)) ** 2, 0.0, None) ** 2, 1e-6)
    left = values - offset - drift * (at_s - middle)
    wander2 = float(np.average(left**2 - sigmas**2, weights=1.0 / sigmas**2))
    fitted = ClockLine(line.late_s(middle) + offset, line.drift + drift, middle)
    return LineFit(
        fitted,
        math.hypot(scale / math.sqrt(information), _SIGMA_FLOOR_S),
        1.0 / math.sqrt(spread / scale**2 + _DRIFT_SIGMA**-2),
        math.sqrt(max(wander2, 0.0)),
        len(values),
    )
