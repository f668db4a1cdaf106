"""Interpolation of sampled positions, angles and orientations at other instants.

Stamps are int64 nanoseconds, strictly increasing; the wanted instants lie within their span, as
nothing is extrapolated.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from rhot.geometry.transforms import Array

Stamps = npt.NDArray[np.int64]


def cubic(stamps_ns: Stamps, values: Array, at_ns: Stamps) -> Array:
    """Cubic spline through (n, ...) at (m,) -> (m, ...)."""
    return np.asarray(
        CubicSpline(_seconds(stamps_ns, stamps_ns), values, axis=0)(_seconds(at_ns, stamps_ns))
    )


def cubic_slope(stamps_ns: Stamps, values: Array, at_ns: Stamps) -> Array:
    """The derivative of that spline at (m,) -> (m, ...), per second."""
    spline = CubicSpline(_seconds(stamps_ns, stamps_ns), values, axis=0)
    return np.asarray(spline(_seconds(at_ns, stamps_ns), 1))


def linear(stamps_ns: Stamps, values: Array, at_ns: Stamps) -> Array:
    """Straight lines through (n, ...) at (m,) -> (m, ...)."""
    index, share = _segments(stamps_ns, at_ns)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return values[index] * (1.0 - share) + values[index + 1] * share


def slerp(stamps_ns: Stamps, wxyz: Array, at_ns: Stamps) -> Array:
    """Shortest arcs through quaternions (n, 4) at (m,) -> (m, 4). Shoemake, SIGGRAPH 1985."""
    index, share = _segments(stamps_ns, at_ns)
    a, b = wxyz[index], wxyz[index + 1]
    dot = np.sum(a * b, axis=1, keepdims=True)
    # q and -q are the same orientation: take the nearer one.
    b = np.where(dot < 0.0, -b, b)
    dot = np.minimum(np.abs(dot), 1.0)
    angle = np.arccos(dot)
    sine = np.sin(angle)
    share = share[:, None]
    # Below 1e-6 rad the arc is its chord.
    small = sine < 1e-6
    safe = np.where(small, 1.0, sine)
    q = np.where(
        small,
        a * (1 - share) + b * share,
        (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / safe,
    )
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.where(q[:, :1] < 0.0, -q, q)


def _seconds(stamps_ns: Stamps, origin_ns: Stamps) -> Array:
    return (stamps_ns - origin_ns[0]) * 1e-9


def _segments(stamps_ns: Stamps, at_ns: Stamps) -> tuple[npt.NDArray[np.intp], Array]:
    """Index of the segment that holds each instant, and its share 0..1 within it; (m,), (m,)."""
    index = np.clip(np.searchsorted(stamps_ns, at_ns, side="right") - 1, 0, len(stamps_ns) - 2)
    return index, (at_ns - stamps_ns[index]) / (stamps_ns[index + 1] - stamps_ns[index])
