"""Views whose heights differ by a constant, made level: cameras that tilted since the calibration.

A mount gives way, or warms up, and a camera nods by a tenth of a degree: a landmark's rays then
pass each other by a pixel. A filter that takes one camera's look after the other's sees it swing up
and down. What the heights of moving markers differ by (monitors/clock_offsets.py) is the cameras'
turn about their baseline; each takes its share, so that the views agree. Turns about other axes
look like depth and are not found by it.

Differences as any good calibration leaves are let be, and what is more than a nod is not believed
all: it is told as a moved camera (monitors/moved_camera.py). Rays are turned on their way to the
filter only; what watches them sees them as they are calibrated.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.intake.observations import View

# Heights of exactly calibrated cameras come out at up to .1 px, for a second at .2 (the other
# renderer's tuning clips). With 0 and with .2, too, errors there and in our own tuning pictures are
# the same to .6 %; of points of a camera that nods by .05 deg NEES is 1.7 with .2, 1.3 with this.
# No more than the latter is levelled: .3 deg.
_LEFT_PX, _MOST_PX = 0.1, 3.0
# Three cameras in a row have three pairs, but their heights are those of two: the rest is noise.
_RIDGE = 1e-3


class LevelViews:
    """How each of C cameras is turned, rad about the rig's axes, as pairs of them tell."""

    def __init__(self, cameras: tuple[Camera, ...]) -> None:
        self._pairs = rectified_pairs(cameras)
        # (P, C, 3): of a pair's height difference, by its cameras' turns.
        self._share = np.zeros((len(self._pairs), len(cameras), 3))
        for row, ((first, second), pair) in enumerate(self._pairs.items()):
            baseline = pair.R_rig_from_rectified[:, 0]
            self._share[row, first], self._share[row, second] = baseline, -baseline
        self._R_camera_from_rig = np.array([c.T_rig_from_camera[:3, :3].T for c in cameras])
        self._heights = dict.fromkeys(self._pairs, 0.0)
        # (C, 3) in the rig's axes, kept up to date in place; and in each camera's own.
        self.turns = np.zeros((len(cameras), 3))
        self._own = self.turns.copy()

    def take(self, heights: Mapping[tuple[int, int], float]) -> None:
        """Turn cameras as their pairs' constant height differences tell (normalised units).

        heights: of first cameras less of second, by the pair of indices; of a pair without one the
        last one stays, as a tilt outlasts what was learned of clocks.
        """
        found = {**self._heights, **heights}
        if found == self._heights:
            return
        self._heights = found
        wanted = [
            _beyond(found[pair] * place.focal_px) / place.focal_px
            for pair, place in self._pairs.items()
        ]
        # The least turns that explain the heights.
        share = self._share.reshape(len(wanted), -1)
        gram = share @ share.T + _RIDGE * np.eye(len(wanted))
        self.turns[:] = (share.T @ np.linalg.solve(gram, wanted)).reshape(-1, 3)
        self._own = np.einsum("cij,cj->ci", self._R_camera_from_rig, self.turns)

    def level(self, view: View) -> View:
        """A view, its rays turned."""
        turn = self._own[view.camera]
        return view._replace(rays=turned_rays(view.rays, turn)) if turn.any() else view


@njit(cache=True)
def add_turns(turns: Array, cameras: Extrinsics, positions: Array, covs: Array) -> None:
    """Add to covs (L, 3, 3) that points (L, 3) may be turned about each camera, by turns (C, 3)."""
    for c in range(turns.shape[0]):
        turn = turns[c]
        if not turn.any():
            continue
        centre = -(cameras.R[c].T @ cameras.t[c])
        for row in range(positions.shape[0]):
            off = np.cross(turn, positions[row] - centre)
            covs[row] += np.outer(off, off) / turns.shape[0]


def _beyond(height_px: float) -> float:
    """What of a height difference is levelled."""
    return float(np.sign(height_px) * min(max(abs(height_px) - _LEFT_PX, 0.0), _MOST_PX))


@njit(cache=True)
def turned_rays(rays: Array, turn: Array) -> Array:
    """Rays (n, 2) turned by a small vector (3,), rad."""
    found = np.empty_like(rays)
    for n in range(len(rays)):
        x, y = rays[n]
        ahead = 1.0 + turn[0] * y - turn[1] * x
        found[n, 0] = (x + turn[1] - turn[2] * y) / ahead
        found[n, 1] = (y + turn[2] * x - turn[0]) / ahead
    return found
