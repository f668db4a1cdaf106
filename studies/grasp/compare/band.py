"""A band about the tip paths of people given as reference, and where one recording leaves it.

Each reference counts once, with the mean of its closings. Paths are paired with the mean path by
dynamic time warping, so that the band is one of shape: pace does not widen it. At each of its
frames the references' points scatter about their mean along its normal; a new person's point is
expected within t * sd * sqrt(1 + 1 / n) of it (prediction interval of a normal distribution, with
Student's t of n - 1 degrees of freedom), widened so far that a reference left out of the band
stays inside at *all* frames as often as asked: many frames are looked at, and each could lie
outside by chance. Pure.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from studies.grasp.compare.shape import warped

# Two people have a mean but hardly a spread.
MIN_REFERENCES = 3
# Two-sided; each frame by itself.
_COVERAGE = 0.95
# Length of a finger below which no path is told from another: dots are seen to 0.2 mm of 80, and
# lengths to 1 %.
_FLOOR = 0.01
# Frames on end that must lie outside: one alone is noise.
_RUN_SHARE = 0.04
# Of averaging warped paths: the third changes nothing that a figure shows.
_ROUNDS = 3


class Band(NamedTuple):
    """In lengths of the finger."""

    mean: Array  # (n, 2)
    normal: Array  # (n, 2) unit, to the right of the way
    half_width: Array  # (n,)
    references: int


class Leaving(NamedTuple):
    """A stretch outside the band."""

    start: float  # share of the closing, 0..1
    end: float
    furthest: float  # from the mean, lengths of the finger; positive towards the outer side
    widths: float  # the same in half widths of the band


class Judged(NamedTuple):
    """One path against a band."""

    deviation: Array  # (n,) along the normal
    path: Array  # (n, 2) paired with the band's mean
    leavings: list[Leaving]
    outside_share: float


def band_of(paths: Sequence[Array]) -> Band:
    """Of the references' paths, each (n, 2). Raises CaptureError for fewer than three."""
    if len(paths) < MIN_REFERENCES:
        raise CaptureError(
            f"{len(paths)} reference recordings: a band needs {MIN_REFERENCES} people at least, and"
            " ten make a useful one"
        )
    raw = _raw_band(paths)
    if len(paths) == MIN_REFERENCES:
        return raw
    # How far each reference leaves the band of the others, at its worst frame.
    worst = []
    for k in range(len(paths)):
        others = _raw_band([one for j, one in enumerate(paths) if j != k])
        off = _deviation(paths[k], others)[0]
        worst.append(float((np.abs(off) / others.half_width).max()))
    # The largest of n left-out ones: a healthy newcomer exceeds it with probability 1 / (n + 1).
    return raw._replace(half_width=raw.half_width * max(1.0, *worst))


class CurveBand(NamedTuple):
    """A band about curves over time, such as a joint's angle; pace counts."""

    mean: Array  # (n,)
    half_width: Array  # (n,)


def curve_band(curves: Sequence[Array], floor: float) -> CurveBand:
    """Of at least three curves (n,), made as the band of paths is; no narrower than `floor`."""
    raw = _raw_curve_band(curves, floor)
    if len(curves) <= MIN_REFERENCES:
        return raw
    worst = []
    for k, curve in enumerate(curves):
        others = _raw_curve_band([one for j, one in enumerate(curves) if j != k], floor)
        worst.append(float((np.abs(curve - others.mean) / others.half_width).max()))
    return raw._replace(half_width=raw.half_width * max(1.0, *worst))


def curve_leavings(curve: Array, band: CurveBand) -> list[Leaving]:
    """Where a curve (n,) leaves a band; furthest in the curve's unit."""
    return _leavings(curve - band.mean, band.half_width)


def _raw_curve_band(curves: Sequence[Array], floor: float) -> CurveBand:
    stack = np.array(curves)
    return CurveBand(stack.mean(axis=0), np.maximum(_half_width(stack), floor))


def _half_width(stack: Array) -> Array:
    """Half the prediction interval (n,) of one more row of stack (k, n)."""
    from scipy.special import stdtrit

    count = len(stack)
    quantile = float(stdtrit(count - 1, 0.5 + 0.5 * _COVERAGE))
    return _smoothed(quantile * stack.std(axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / count))


def judged(path: Array, band: Band) -> Judged:
    """Where a path (n, 2) leaves a band."""
    off, paired = _deviation(path, band)
    outside = float((np.abs(off) > band.half_width).mean())
    return Judged(off, paired, _leavings(off, band.half_width), outside)


def _leavings(off: Array, half_width: Array) -> list[Leaving]:
    """Stretches of off (n,) outside half_width (n,), but for single frames."""
    least = max(2, round(_RUN_SHARE * len(off)))
    leavings = []
    edges = np.diff(np.concatenate([[0], np.abs(off) > half_width, [0]]).astype(int))
    starts, ends = np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist()
    for start, end in zip(starts, ends, strict=True):
        if end - start >= least:
            worst = start + int(np.argmax(np.abs(off[start:end])))
            last = max(len(off) - 1, 1)
            widths = float(abs(off[worst]) / half_width[worst])
            leavings.append(Leaving(start / last, (end - 1) / last, float(off[worst]), widths))
    return leavings


def _raw_band(paths: Sequence[Array]) -> Band:
    mean = np.mean(paths, axis=0)
    for _ in range(_ROUNDS):
        paired = np.array([warped(one, mean) for one in paths])
        mean = paired.mean(axis=0)
    normal = _normals(mean)
    off = np.einsum("knj,nj->kn", paired - mean, normal)
    return Band(mean, normal, np.maximum(_half_width(off), _FLOOR), len(paths))


def _deviation(path: Array, band: Band) -> tuple[Array, Array]:
    """Along the normal (n,), and the path (n, 2) as it is paired."""
    paired = warped(path, band.mean)
    return np.einsum("nj,nj->n", paired - band.mean, band.normal), paired


def _normals(path: Array) -> Array:
    """Unit normals (n, 2) of a path, from its way over a tenth of it."""
    reach = max(len(path) // 20, 1)
    frames = np.arange(len(path))
    after = path[np.minimum(frames + reach, len(path) - 1)]
    way = after - path[np.maximum(frames - reach, 0)]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
    return np.column_stack([way[:, 1], -way[:, 0]])


def _smoothed(values: Array) -> Array:
    """A mean over a tenth of the path."""
    half = max(len(values) // 20, 1)
    padded = np.pad(values, half, mode="edge")
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")
