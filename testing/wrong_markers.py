"""Frames whose markers are wrong in ways that are not white noise: what clocks must not learn from.

Errors of a learned detector, which last for some frames and are shared by neighbours; coloured
things, or a frozen picture, in place of a hand; clocks that read otherwise than they say.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec
import numpy as np

from rhot.messages import MarkerFrame
from testing.synthetic_points import COLORS, SIZE_PX, START_NS

_replace = msgspec.structs.replace
# Each error has this much in common with the one of the frame before, and with its neighbour's.
CORRELATION, NEIGHBOURS = 0.7, 0.7


def master_time_s(frame: MarkerFrame) -> float:
    """A frame's instant as its stamp and its announced offset have it, since START_NS."""
    return (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9


def with_correlated_errors(
    given: Iterable[MarkerFrame], sigma_px: float, seed: int = 1
) -> list[MarkerFrame]:
    """Each camera's markers off by sigma_px, as of an AR(1) process, and nobody says so."""
    random = np.random.default_rng([seed, 8])
    apart = np.abs(np.subtract.outer(np.arange(len(COLORS)), np.arange(len(COLORS))))
    together = np.linalg.cholesky(NEIGHBOURS**apart)  # (6, 6)
    last = {}
    found = []
    for frame in given:
        fresh = sigma_px * together @ random.normal(size=(len(COLORS), 2))  # (6, 2)
        before = last.get(frame.camera, fresh)
        errors = CORRELATION * before + np.sqrt(1.0 - CORRELATION**2) * fresh
        last[frame.camera] = errors
        markers = []
        for marker in frame.markers:
            x, y = (errors[COLORS.index(marker.color)] + (marker.x_px, marker.y_px)).tolist()
            if 0.0 <= x <= SIZE_PX[0] - 1 and 0.0 <= y <= SIZE_PX[1] - 1:
                markers.append(_replace(marker, x_px=x, y_px=y))
        found.append(_replace(frame, markers=markers))
    return found


def with_static_markers(
    given: Iterable[MarkerFrame],
    camera: str,
    between_s: tuple[float, float],
    *,
    frozen: bool,
    seed: int = 1,
) -> list[MarkerFrame]:
    """A camera's markers at places of their own for a while: its last ones (frozen), or any."""
    random = np.random.default_rng([seed, 9])
    places = {color: random.uniform((100.0, 80.0), (540.0, 400.0)) for color in COLORS}
    found = []
    for frame in given:
        if frame.camera == camera and master_time_s(frame) < between_s[0] and frozen:
            for marker in frame.markers:
                places[marker.color] = np.array([marker.x_px, marker.y_px])
        if frame.camera == camera and between_s[0] <= master_time_s(frame) < between_s[1]:
            markers = []
            for marker in frame.markers:
                x, y = places[marker.color] + random.normal(0.0, marker.sigma_px * (not frozen), 2)
                markers.append(_replace(marker, x_px=float(x), y_px=float(y)))
            frame = _replace(frame, markers=markers)
        found.append(frame)
    return found


def with_clock_error(
    given: Iterable[MarkerFrame], camera: str, late_s: float, sigma_ns: int | None = None
) -> list[MarkerFrame]:
    """A camera's stamps later than it says, and all cameras' announced sigmas (-1: unknown)."""
    found = []
    for frame in given:
        sigma = frame.clock_sigma_ns if sigma_ns is None else sigma_ns
        late_ns = round(late_s * 1e9) if frame.camera == camera else 0
        found.append(_replace(frame, stamp_ns=frame.stamp_ns + late_ns, clock_sigma_ns=sigma))
    return found
