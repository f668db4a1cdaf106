"""A view that is mirrored by a wrong setting (hflip or vflip of one camera), told by its markers.

What is right of another marker for one camera of a pair is so for the other one, and what is above
is above, but for the small shifts that depth makes. So the correlation of the markers' places in
two views is near +1; where a view is mirrored it is near -1 along one axis. Fewer than four common
markers, or markers on one spot, tell nothing: what was reported stays.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.geometry.rectified_pair import rectified_pairs, rectify_ray
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
        geometry = self._pairs[pair]
        told, *reversed_order = _order(
            (first.landmarks, second.landmarks),
            (first.rays, second.rays),
            (geometry.R_rectified_from_first, geometry.R_rectified_from_second),
            _MIN_SPREAD_PX2 / geometry.focal_px**2,
        )
        if not told:
            return
        share = self._shares[pair]
        share += _NEW * (np.array(reversed_order) - share)
        if share.max() > _SHARE_ON:
            self._axis[pair] = _AXES[int(share.argmax())]
        elif share.max() < _SHARE_OFF:
            self._axis.pop(pair, None)


@njit(cache=True)
def _order(
    landmarks: tuple[Ints, Ints],
    rays: tuple[Array, Array],
    rotations: tuple[Array, Array],
    least_spread: float,
) -> tuple[bool, bool, bool]:
    """Whether the common landmarks of two views tell their order, and whether it is reversed along
    each axis; landmarks (n,) ascending, rays (n, 2), rotations (3, 3) into the pair's frame.

    least_spread: of a landmark, squared, in the rays' units.
    """
    common = 0
    places = np.empty((2, min(len(landmarks[0]), len(landmarks[1])), 2))
    second = 0
    for first in range(len(landmarks[0])):
        while second < len(landmarks[1]) and landmarks[1][second] < landmarks[0][first]:
            second += 1
        if second == len(landmarks[1]) or landmarks[1][second] != landmarks[0][first]:
            continue
        for view, row in enumerate((first, second)):
            x, y = rectify_ray(rotations[view], rays[view][row])
            if not x < np.inf:
                return False, False, False
            places[view, common, 0], places[view, common, 1] = x, y
        common += 1
    if common < _MIN_MARKERS:
        return False, False, False
    is_reversed = np.zeros(2, dtype=np.bool_)
    for axis in range(2):
        a, b = places[0, :common, axis], places[1, :common, axis]
        a, b = a - a.mean(), b - b.mean()
        spread = math.sqrt(np.sum(a * a) * np.sum(b * b))  # of both views
        if not least_spread * common <= spread < np.inf:
            return False, False, False
        is_reversed[axis] = np.sum(a * b) < _MIRRORED * spread
    return True, is_reversed[0], is_reversed[1]
