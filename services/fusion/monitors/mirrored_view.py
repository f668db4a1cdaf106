"""A view that is mirrored by a wrong setting (hflip or vflip of one camera), told by its markers.

What is right of another marker for one camera of a pair is so for the other one, and what is above
is above, but for the small shifts that depth makes. So the correlation of the markers' places in
two views is near +1; where a view is mirrored it is near -1 along one axis. Fewer than four common
markers, or markers on one spot, tell nothing: what was reported stays.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import Camera
from services.fusion.geometry.rectified_pair import rectified_pairs, rectify_rays
from services.fusion.intake.observations import View

# Views this far apart in time, at most, are compared: a hand does not turn over within three
# frames.
_TOGETHER_NS = 100_000_000
# Between two comparisons of a pair: cheap, and a second of them is enough to be sure.
_COMPARE_NS = 100_000_000
_MIN_MARKERS = 4
# Correlation below which two views count as mirrored: a hand seen edge on, whose depth outweighs
# its width, comes down to about 0.
_MIRRORED = -0.5
# Share of a new comparison in the running one, and where the report turns: some 12 comparisons in a
# row, 1.2 s.
_NEW, _SHARE_ON, _SHARE_OFF = 0.1, 0.7, 0.3
# Markers within some pixels of a line or a spot have no order: mean square spread, px^2.
_MIN_SPREAD_PX2 = 100.0
_AXES = ("horizontally", "vertically")


class MirrorMonitor:
    """Running shares, per pair of cameras and axis, of views whose markers' order is reversed."""

    def __init__(self, cameras: tuple[Camera, ...]) -> None:
        self._pairs = rectified_pairs(cameras)
        self._names = [camera.name for camera in cameras]
        self._latest: list[View | None] = [None] * len(cameras)
        self._compared_ns = dict.fromkeys(self._pairs, -_COMPARE_NS)
        self._shares = {pair: np.zeros(2) for pair in self._pairs}
        self._axis: dict[tuple[int, int], str] = {}  # by mirrored pair

    @property
    def mirrored(self) -> dict[tuple[str, str], str]:
        """Pairs of cameras one of which delivers a mirrored picture, and along which axis."""
        return {
            (self._names[first], self._names[second]): axis
            for (first, second), axis in self._axis.items()
        }

    def observe(self, view: View) -> None:
        """Compare a frame with the latest of every other camera."""
        self._latest[view.camera] = view
        for pair in self._pairs:
            due = abs(view.instant_ns - self._compared_ns[pair]) >= _COMPARE_NS
            if view.camera not in pair or not due:
                continue
            first, second = self._latest[pair[0]], self._latest[pair[1]]
            if first is None or second is None:
                continue
            if abs(first.instant_ns - second.instant_ns) <= _TOGETHER_NS:
                self._compared_ns[pair] = view.instant_ns
                self._compare(pair, first, second)

    def _compare(self, pair: tuple[int, int], first: View, second: View) -> None:
        _, in_first, in_second = np.intersect1d(
            first.landmarks, second.landmarks, assume_unique=True, return_indices=True
        )
        if len(in_first) < _MIN_MARKERS:
            return
        geometry = self._pairs[pair]
        a = rectify_rays(geometry.R_rectified_from_first, first.rays[in_first])  # (n, 2)
        b = rectify_rays(geometry.R_rectified_from_second, second.rays[in_second])
        a = a - a.mean(axis=0)
        b = b - b.mean(axis=0)
        # Both views' spread along each axis (2,).
        spread = np.sqrt(np.sum(a**2, axis=0) * np.sum(b**2, axis=0))
        least_px2 = _MIN_SPREAD_PX2 * len(in_first)
        if not np.all(np.isfinite(spread)) or spread.min() * geometry.focal_px**2 < least_px2:
            return
        reversed_order = np.sum(a * b, axis=0) < _MIRRORED * spread  # (2,)
        share = self._shares[pair]
        share += _NEW * (reversed_order - share)
        if share.max() > _SHARE_ON:
            self._axis[pair] = _AXES[int(share.argmax())]
        elif share.max() < _SHARE_OFF:
            self._axis.pop(pair, None)
