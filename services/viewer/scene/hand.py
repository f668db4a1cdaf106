"""A hand in the scene: joints as balls, bones as tubes, limits as lines, trails of finger tips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from rhot.geometry.transforms import Array
from rhot.hand import HandModel
from services.viewer.live.palette import BACKGROUND, LIMIT, LINE, SOURCE_RGB
from services.viewer.live.views import HandView
from services.viewer.scene.limit_lines import HandLimits
from services.viewer.scene.shapes import (
    BONES,
    cylinders,
    f32,
    fading_lines,
    unit_cylinder,
    unit_sphere,
)
from services.viewer.scene.spheres import place, put, reveal

# Joints at their full skin radius would hide the bones, and fill the skin; with these shares of it,
# all three are seen.
_JOINT_SHARE, _BONE_SHARE = 0.6, 0.32
# Joints inside the palm have thick skin, and would be one lump.
_MAX_JOINT_M, _MAX_BONE_M = 0.0062, 0.0034
# Sources from most to least certain: a bone is as certain as its worse end.
_SOURCES = tuple(SOURCE_RGB)
# Lines of limits, and those of limits that are reached.
_THIN_M, _THICK_M = 0.0007, 0.0024
_NOTHING = np.zeros((1, 2, 3))
_PALETTE = np.array([SOURCE_RGB[source] for source in _SOURCES], dtype=np.uint8)


class Stick:
    """Joints and bones of one hand."""

    def __init__(self, scene: viser.SceneApi, path: str) -> None:
        turns = np.tile([1.0, 0.0, 0.0, 0.0], (max(26, len(BONES)), 1))
        self._joints, self._bones = (
            scene.add_batched_meshes_simple(
                f"{path}/{name}",
                *mesh,
                turns[:count],
                np.zeros((count, 3)),
                batched_scales=np.full((count, 3), 0.01),
                batched_colors=_PALETTE[np.ones(count, dtype=int)],
                lod="off",
            )
            for name, mesh, count in (
                ("joints", unit_sphere(), 26),
                ("bones", unit_cylinder(), len(BONES)),
            )
        )

    def show(self, view: HandView | None) -> None:
        """Draw a pose; None hides it."""
        reveal(self._joints, view is not None)
        reveal(self._bones, view is not None)
        if view is None:
            return
        place(self._joints, view.positions_m, np.minimum(_JOINT_SHARE * view.radii_m, _MAX_JOINT_M))
        start, end = BONES.T
        middle, wxyz, length = cylinders(view.positions_m[start], view.positions_m[end])
        radius = np.minimum(view.radii_m[start], view.radii_m[end])
        radius = np.minimum(_BONE_SHARE * radius, _MAX_BONE_M)
        # To the micrometre: a bone is as long in each picture.
        scales = np.stack([radius, radius, length], axis=1).round(6)
        put(
            self._bones,
            batched_positions=f32(middle),
            batched_wxyzs=f32(wxyz),
            batched_scales=f32(scales),
        )
        uncertainty = np.array([_SOURCES.index(source) for source in view.sources])
        put(self._joints, batched_colors=_PALETTE[uncertainty])
        worse = np.maximum(uncertainty[start], uncertainty[end])
        put(self._bones, batched_colors=_PALETTE[worse])


class Limits:
    """The limits of one hand."""

    def __init__(self, scene: viser.SceneApi, path: str, model: HandModel) -> None:
        self._limits = HandLimits(model)
        self._all = scene.add_line_segments(path, _NOTHING, LINE, thickness=_THIN_M, visible=False)
        self._reached = scene.add_line_segments(
            f"{path}/reached", _NOTHING, LIMIT, thickness=_THICK_M, visible=False
        )

    def show(self, view: HandView | None) -> None:
        """About the joints of a pose; None hides them."""
        reveal(self._all, view is not None)
        if view is None:
            return
        lines_m, reached = self._limits.lines(
            view.positions_m, view.rotations, view.pose.angles_rad
        )
        self._all.points = f32(lines_m)
        reveal(self._reached, bool(reached.any()))
        if reached.any():
            self._reached.points = f32(lines_m[reached])


class Trails:
    """The trails of one hand's finger tips; they fade away from the tip."""

    def __init__(self, scene: viser.SceneApi, path: str) -> None:
        self._lines = scene.add_line_segments(
            path, np.zeros((1, 2, 3)), np.zeros((1, 2, 3), np.uint8), thickness=0.001, visible=False
        )

    def show(self, trail: Sequence[Array]) -> None:
        """Tips (n, 5, 3), oldest first; fewer than two hide them."""
        reveal(self._lines, len(trail) > 1)
        if len(trail) > 1:
            lines_m, colors = fading_lines(np.array(trail), BACKGROUND, LINE)
            self._lines.points, self._lines.colors = f32(lines_m), colors
