"""Painted landmarks in the scene: a dot in the colour of the paint, a cloud for how sure it is.

The cloud is the ellipsoid that a marker is inside of 19 times of 20. Round a marker that is known
well it is smaller than the dot, and is not seen.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from rhot.geometry.transforms import Array
from services.viewer.live.palette import SOURCE_RGB, UNKNOWN, Rgb
from services.viewer.live.views import PointView
from services.viewer.scene.shapes import ellipsoids, f32
from services.viewer.scene.spheres import HIDDEN_M, add_spheres, place, put, reveal

_DOT_M, _PREDICTED_DOT_M = 0.0055, 0.0035
_CLOUD_OPACITY = 0.3
# A cloud whose variances change by less looks as it did: its axes change by half as much.
_SEEN = 0.05


class Markers:
    """The markers of one hand, each in its slot."""

    def __init__(
        self, scene: viser.SceneApi, dots: str, clouds: str, paints: Mapping[str, Rgb]
    ) -> None:
        self._names = list(paints)
        colors = np.array(list(paints.values()) or [UNKNOWN], dtype=np.uint8)
        self._dots = add_spheres(scene, dots, colors)
        self._clouds = add_spheres(scene, clouds, np.zeros_like(colors), _CLOUD_OPACITY)
        self._drawn: tuple[object, ...] = ()
        # What the clouds were shaped by: slots and whether predicted, and covariances.
        self._shapes: list[tuple[int, bool]] = []
        self._covariance_m2 = np.zeros((0, 6))

    def show(self, points: Mapping[str, PointView], *, clouds: bool) -> None:
        """Place those that are known; clouds only if somebody looks at them."""
        if (wanted := (points, clouds)) == self._drawn:
            return
        self._drawn = wanted
        reveal(self._dots, bool(points))
        reveal(self._clouds, clouds and bool(points))
        count = max(len(self._names), 1)
        positions, radii = np.zeros((count, 3)), np.full(count, HIDDEN_M)
        known = [(i, points[name]) for i, name in enumerate(self._names) if name in points]
        if not known:
            return
        for slot, point in known:
            positions[slot] = point.position_m
            radii[slot] = _PREDICTED_DOT_M if point.predicted else _DOT_M
        place(self._dots, positions, radii)
        if clouds:
            self._show_clouds(positions, known)

    def _show_clouds(self, positions: Array, known: list[tuple[int, PointView]]) -> None:
        put(self._clouds, batched_positions=f32(positions))
        shapes = [(slot, point.predicted) for slot, point in known]
        covariance_m2 = np.array([point.covariance_m2 for _, point in known])
        if shapes == self._shapes and np.allclose(
            covariance_m2, self._covariance_m2, rtol=_SEEN, atol=_SEEN * np.abs(covariance_m2).max()
        ):
            return
        self._shapes, self._covariance_m2 = shapes, covariance_m2
        slots = [slot for slot, _ in known]
        wxyz = np.tile([1.0, 0.0, 0.0, 0.0], (len(positions), 1))
        axes = np.full((len(positions), 3), HIDDEN_M)
        wxyz[slots], axes[slots] = ellipsoids(covariance_m2)
        colors = np.zeros((len(positions), 3), dtype=np.uint8)
        colors[slots] = [SOURCE_RGB["predicted" if p.predicted else "measured"] for _, p in known]
        put(
            self._clouds,
            batched_wxyzs=f32(wxyz),
            batched_scales=f32(axes),
            batched_colors=colors,
        )
