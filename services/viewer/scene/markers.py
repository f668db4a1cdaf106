"""Painted landmarks in the scene: a dot in the colour of the paint, a cloud for how sure it is.

The cloud is the ellipsoid that a marker is inside of 19 times of 20. Round a marker that is known
well it is smaller than the dot, and is not seen.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from rhot.geometry.transforms import Array
from services.viewer.live.model import PointView
from services.viewer.live.palette import SOURCE_RGB, UNKNOWN, Rgb
from services.viewer.scene.shapes import ellipsoids, f32
from services.viewer.scene.spheres import HIDDEN_M, add_spheres, place

_DOT_M, _PREDICTED_DOT_M = 0.0055, 0.0035
_CLOUD_OPACITY = 0.3


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

    def show(self, points: Mapping[str, PointView], *, clouds: bool) -> None:
        """Place those that are known; clouds only if somebody looks at them."""
        if (wanted := (points, clouds)) == self._drawn:
            return
        self._drawn = wanted
        self._dots.visible = bool(points)
        self._clouds.visible = clouds and bool(points)
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
        slots = [slot for slot, _ in known]
        wxyz = np.tile([1.0, 0.0, 0.0, 0.0], (len(positions), 1))
        axes = np.full((len(positions), 3), HIDDEN_M)
        wxyz[slots], axes[slots] = ellipsoids(np.array([one.covariance_m2 for _, one in known]))
        colors = np.zeros((len(positions), 3), dtype=np.uint8)
        colors[slots] = [SOURCE_RGB["predicted" if p.predicted else "measured"] for _, p in known]
        self._clouds.batched_positions = f32(positions)
        self._clouds.batched_wxyzs = f32(wxyz)
        self._clouds.batched_scales = f32(axes)
        self._clouds.batched_colors = colors
