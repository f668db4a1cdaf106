"""A view that is mirrored by a wrong setting (hflip or vflip of one camera), told by the order of
the markers in it.

What is right of another marker for one camera of a pair is so for the other one, and what is above
is above, but for the small shifts that depth makes. So the correlation of the markers' places in
two views is near +1; where a view is mirrored it is near -1 along one axis. Fewer than four common
markers, or markers on one spot, teach nothing; the verdict stays what it was.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.intake.observations import View
from services.fusion.paired.depth_law import RectifiedPair, rectified_pair

# Looks this far apart in time, at most, are compared: a hand does not turn over within three
# frames.
_TOGETHER_NS = 100_000_000
# Between two looks at a pair: cheap, and a second of them is enough to be sure.
_LOOK_NS = 100_000_000
_MIN_MARKERS = 4
# Correlation below which a look speaks for a mirrored view: a hand seen edge on, whose depth
# outweighs its width, comes down to about 0.
_MIRRORED = -0.5
# Share of a new look in the running one, and where the verdict turns: some 12 looks in a row, 1.2
# s.
_NEW, _SHARE_ON, _SHARE_OFF = 0.1, 0.7, 0.3
_AXES = ("horizontally", "vertically")


class MirrorWatch:
    """Running shares, per pair of cameras and axis, of looks in which the order of the markers is
    reversed.
    """

    def __init__(self, cameras: tuple[Camera, ...]) -> None:
        pairs = {
            (i, j): rectified_pair(cameras[i], cameras[j])
            for i, j in combinations(range(len(cameras)), 2)
        }
        self._pairs: dict[tuple[int, int], RectifiedPair] = {
            key: pair for key, pair in pairs.items() if pair is not None
        }
        self._names = [camera.name for camera in cameras]
        self._latest: list[View | None] = [None] * len(cameras)
        self._looked_ns = dict.fromkeys(self._pairs, -_LOOK_NS)
        self._shares = {pair: np.zeros(2) for pair in self._pairs}
        self._said: dict[tuple[int, int], str] = {}

    @property
    def mirrored(self) -> dict[tuple[str, str], str]:
        """Pairs of cameras one of which delivers a mirrored picture, and along which axis."""
        return {(self._names[a], self._names[b]): axis for (a, b), axis in self._said.items()}

    def observe(self, view: View) -> None:
        """Compare a frame with the latest of every other camera."""
        self._latest[view.camera] = view
        for pair in self._pairs:
            other = (
                self._latest[pair[0] if view.camera == pair[1] else pair[1]]
                if view.camera in pair
                else None
            )
            due = abs(view.instant_ns - self._looked_ns[pair]) >= _LOOK_NS
            if (
                other is not None
                and due
                and abs(view.instant_ns - other.instant_ns) <= _TOGETHER_NS
            ):
                self._looked_ns[pair] = view.instant_ns
                self._look(pair, *((view, other) if view.camera == pair[0] else (other, view)))

    def _look(self, pair: tuple[int, int], first: View, second: View) -> None:
        _, a, b = np.intersect1d(first.slots, second.slots, assume_unique=True, return_indices=True)
        if len(a) < _MIN_MARKERS:
            return
        geometry = self._pairs[pair]
        places = (
            _rectified(geometry.R_rectified_from_first, first.rays[a]),
            _rectified(geometry.R_rectified_from_second, second.rays[b]),
        )
        left, right = (place - place.mean(axis=0) for place in places)
        size = np.sqrt(np.sum(left**2, axis=0) * np.sum(right**2, axis=0))
        # Markers within some pixels of a line or a spot have no order.
        if not np.all(np.isfinite(size)) or size.min() * geometry.focal_px**2 < 100.0 * len(a):
            return
        share = self._shares[pair]
        share += _NEW * ((np.sum(left * right, axis=0) < _MIRRORED * size) - share)
        if share.max() > _SHARE_ON:
            self._said[pair] = _AXES[int(share.argmax())]
        elif share.max() < _SHARE_OFF:
            self._said.pop(pair, None)


def _rectified(R: Array, rays: Array) -> Array:
    """x/z, y/z (n, 2) of rays (n, 2) in the pair's common frame."""
    turned = np.column_stack([rays, np.ones(len(rays))]) @ R.T
    return turned[:, :2] / np.where(turned[:, 2:] > 0.0, turned[:, 2:], np.nan)
