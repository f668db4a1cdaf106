"""How fast a process's memory grows, from samples of a run that is short beside an hour. Pure.

A leak goes on; a heap that has found a new largest moment grows once, in a step. A straight line
through a step of 1.3 MB in the middle of 20 minutes says 4 MB/h and its usual interval excludes 3,
although nothing grew before and nothing after. So the line may have one step, if that is larger
than what would be allowed in all; leaks, which come in many small steps, have none that large.
A step down counts as it is if it only gives back what came during the run: a heap that fills and
empties is steep between two steps for ever. The price: with 20 minutes a leak of 2 MB/h is told in
one case of four where .3 MB are given back meanwhile, and always where nothing is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

# Medians of so many stretches of the run stand for its samples: of shorter ones the noise is more
# alike from one to the next, and of longer ones too few are left beside a step.
_STRETCHES = 24
# What a stretch's level is known to at best, in MB: a few pages.
_RESOLUTION_MB = 0.02
# A step is set aside if, counted as growth, it alone would be this much of the limit. A line
# through a step in the middle is 1.5 times as steep as the step over the whole time.
_SHARE_OF_LIMIT = 2.0 / 3.0
# Heights of steps and gains are known to about a quarter, of the wander of a heap beside them.
_ABOUT = 1.25
# A step is two more parameters, its time and its height, and a time is chosen among many: three
# times the logarithm of the number of stretches (modified Bayesian information, Zhang and
# Siegmund 2007, has it for changes of a mean).
_COST_OF_A_STEP = 3.0


@dataclass(frozen=True)
class Growth:
    """MB/h with its 95 % interval, and the one step in MB that was set aside (0: none)."""

    mb_h: float
    low_mb_h: float
    high_mb_h: float
    step_mb: float


def memory_growth(times_s: np.ndarray, megabytes: np.ndarray, limit_mb_h: float) -> Growth:
    """Growth of samples (n,) in MB at times (n,) in s, ascending.

    Raises ValueError for fewer than two samples for each of 24 stretches.
    """
    if len(times_s) < 2 * _STRETCHES:
        raise ValueError(f"{len(times_s)} samples; growth takes at least {2 * _STRETCHES}")
    parts = np.array_split(np.arange(len(times_s)), _STRETCHES)
    hours = np.array([times_s[part].mean() for part in parts]) / 3600.0
    levels = np.array([np.median(megabytes[part]) for part in parts])
    line = np.column_stack([np.ones(_STRETCHES), hours - hours.mean()])
    straight = _fit(line, levels)
    largest_mb = _SHARE_OF_LIMIT * limit_mb_h * (times_s[-1] - times_s[0]) / 3600.0
    # Not at the ends: two stretches each are the least that a level is known from.
    bent = [
        _fit(np.column_stack([line, np.arange(_STRETCHES) >= first]), levels)
        for first in range(2, _STRETCHES - 1)
    ]
    best = min(bent, key=_misfit)
    gain = _STRETCHES * (np.log(_misfit(straight)) - np.log(_misfit(best)))
    worth_it = gain > _COST_OF_A_STEP * np.log(_STRETCHES)
    # Of either sign: heaps are given back in steps, too; upward ones alone would hide a leak.
    large = abs(best.values[2]) > largest_mb and not _gave_back_its_gain(best, hours - hours[0])
    chosen = best if worth_it and large else straight
    half = _half_width(chosen)
    slope = float(chosen.values[1])
    step_mb = float(chosen.values[2]) if chosen is best else 0.0
    return Growth(slope, slope - half, slope + half, step_mb)


@dataclass(frozen=True)
class _Fit:
    design: np.ndarray
    values: np.ndarray
    residuals: np.ndarray


def _fit(design: np.ndarray, levels: np.ndarray) -> _Fit:
    values = np.linalg.lstsq(design, levels, rcond=None)[0]
    return _Fit(design, values, levels - design @ values)


def _gave_back_its_gain(fit: _Fit, hours: np.ndarray) -> bool:
    """Whether a step down is about what had come since the start, or less; hours (24,).

    A heap that fills and empties leaks nothing; its slope between two steps says otherwise.
    """
    gained_mb = float(fit.values[1]) * hours[int(np.argmax(fit.design[:, 2]))]
    return bool(-_ABOUT * gained_mb <= fit.values[2] < 0.0)


def _misfit(fit: _Fit) -> float:
    return float(np.mean(fit.residuals**2)) + _RESOLUTION_MB**2


def _half_width(fit: _Fit) -> float:
    """Half of the slope's 95 % interval in MB/h: residuals that stay on one side for long, as those
    of a heap do, count for fewer (an autoregressive process of first order).
    """
    count, parameters = fit.design.shape
    rest = fit.residuals
    variance = (rest @ rest) / (count - parameters) + _RESOLUTION_MB**2
    alike = float(rest[1:] @ rest[:-1] / (rest @ rest + count * _RESOLUTION_MB**2))
    # The estimate from so few is too low by about this.
    alike = min(max(alike + (1.0 + 4.0 * alike) / count, 0.0), 0.9)
    covariance = np.linalg.inv(fit.design.T @ fit.design) * variance
    spread = np.sqrt(covariance[1, 1] * (1.0 + alike) / (1.0 - alike))
    return float(student.ppf(0.975, count - parameters) * spread)
